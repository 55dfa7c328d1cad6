#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/scene/deformation.h"
#include "tests/unit/import/gltf_maker.h"

namespace umbriel::test {
namespace {

using Bytes = std::vector<std::uint8_t>;

// A triangle on two joints: nodes 1 and 2 are joints, node 0 has the mesh.
struct SkinnedMaker : GltfMaker {
    std::vector<float> weights = {1, 0, 0, 0, 0.5f, 0.5f, 0, 0, 0, 1, 0, 0};
    Bytes joints = {0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0};
    std::vector<float> inverseBinds = std::vector<float>(32, 0.0f);

    SkinnedMaker() {
        for (const std::size_t i : {0u, 5u, 10u, 15u, 16u, 21u, 26u, 31u}) inverseBinds[i] = 1.0f;
        inverseBinds[12] = -3.0f;  // the translation of the first
    }
    nlohmann::json primitive;
    void build() {
        primitive["attributes"]["POSITION"] = addFloats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
        primitive["attributes"]["JOINTS_0"] = addAccessor(joints, 5121, "VEC4");
        primitive["attributes"]["WEIGHTS_0"] = addFloats(weights, "VEC4");
        addMeshNode(primitive);
        document["nodes"][0]["skin"] = 0;
        add("nodes", {{"name", "hip"}});
        add("nodes", {{"name", "knee"}, {"translation", {0, 1, 0}}});
        document["nodes"][1]["children"] = {2};
        document["scenes"][0]["nodes"].push_back(1);
        const int accessor = addFloats(inverseBinds, "MAT4");
        document["accessors"][static_cast<std::size_t>(accessor)]["count"] = inverseBinds.size() / 16;
        add("skins", {{"joints", {1, 2}}, {"inverseBindMatrices", accessor}});
    }
};

TEST(GltfDeformation, ASkinArrivesWithItsJointsMatricesAndWeights) {
    SkinnedMaker maker;
    maker.build();
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_TRUE(loaded.file->warnings.empty()) << loaded.file->warnings.front();
    const auto& skin = loaded.only<Skin>();
    ASSERT_EQ(skin.joints.size(), 2u);
    EXPECT_EQ(loaded.scene->get(skin.joints[1]).name.get(), "knee");
    EXPECT_EQ(skin.inverseBinds[0][3], glm::vec4(-3, 0, 0, 1));
    const auto& deformed = loaded.only<DeformedGeometry>();
    EXPECT_EQ(deformed.skin.get().id, skin.id());
    EXPECT_FALSE(deformed.morph.get());
    const auto& geometry = loaded.scene->get(deformed.geometry.get());
    EXPECT_EQ(geometry.jointWeights[1], glm::vec4(0.5f, 0.5f, 0, 0));
    EXPECT_EQ(geometry.joints.toVector(), (std::vector<std::uint16_t>{0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0}))
        << "joints that do not count are not kept";
}

TEST(GltfDeformation, JointsBeyondTheSkinAreRefusedUnlessTheyWeighNothing) {
    SkinnedMaker maker;
    maker.joints[2] = 77;  // weight 0
    maker.build();
    EXPECT_TRUE(load(maker).file);
    SkinnedMaker broken;
    broken.joints[9] = 2;
    broken.build();
    EXPECT_NE(load(broken).error().find("nodes[0].mesh: its vertices name joint 2, skin 0 has 2"), std::string::npos)
        << load(broken).error();
}

TEST(GltfDeformation, JointsWhoseWaysUpTogetherAreTooLongAreRefused) {
    SkinnedMaker maker;
    maker.build();
    // With the scene's own node the hip has 2 nodes on its way, the knee 3.
    ImportLimits limits;
    limits.stepsUp = 5;
    EXPECT_TRUE(load(maker, limits).file) << load(maker, limits).error();
    limits.stepsUp = 4;
    EXPECT_NE(load(maker, limits).error().find("skins[0].joints[1]: joints, lights and cameras lie too deep"),
              std::string::npos)
        << load(maker, limits).error();
}

TEST(GltfDeformation, BadWeightsAreRepairedWithAWarning) {
    SkinnedMaker maker;
    maker.weights = {-1, 1, 0, 0, 2, 2, 0, 0, 0, 0, 0, 0};
    maker.build();
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_TRUE(loaded.warnsOf("WEIGHTS_0: 1 weights are negative or not numbers"));
    EXPECT_TRUE(loaded.warnsOf("WEIGHTS_0: 2 vertices have weights that do not sum to 1"));
    SkinnedMaker nan;
    nan.weights[0] = std::numeric_limits<float>::quiet_NaN();
    nan.build();
    EXPECT_TRUE(load(nan).warnsOf("WEIGHTS_0: 1 weights are negative or not numbers"));
}

TEST(GltfDeformation, TheFourStrongestOfEightJointsCount) {
    SkinnedMaker maker;
    maker.weights = {0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f};
    maker.joints = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    maker.primitive["attributes"]["JOINTS_1"] = maker.addAccessor(Bytes(12, 1), 5121, "VEC4");
    maker.primitive["attributes"]["WEIGHTS_1"] =
        maker.addFloats({0.3f, 0.3f, 0, 0, 0.3f, 0.3f, 0, 0, 0.3f, 0.3f, 0, 0}, "VEC4");
    maker.build();
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_TRUE(loaded.warnsOf("3 vertices hang on more than four joints"));
    EXPECT_EQ(loaded.only<Geometry>().jointWeights[0], glm::vec4(0.3f, 0.3f, 0.1f, 0.1f));
    EXPECT_EQ(loaded.only<Geometry>().joints[0], 1);
    EXPECT_EQ(loaded.only<Geometry>().joints[2], 0);
}

TEST(GltfDeformation, BrokenSkinsAreRefusedWithTheirPlace) {
    const auto errorOf = [](const std::function<void(SkinnedMaker&)>& before,
                            const std::function<void(SkinnedMaker&)>& after) {
        SkinnedMaker maker;
        before(maker);
        maker.build();
        after(maker);
        return load(maker).error();
    };
    const auto nothing = [](SkinnedMaker&) {};
    const auto expect = [](const std::string& error, const std::string& text) {
        EXPECT_NE(error.find(text), std::string::npos) << error << "\nlacks " << text;
    };
    expect(errorOf([](SkinnedMaker& m) { m.inverseBinds.resize(16); }, nothing),
           "skins[0].inverseBindMatrices: has 1 matrices for 2 joints");
    expect(errorOf([](SkinnedMaker& m) { m.inverseBinds[20] = std::numeric_limits<float>::infinity(); }, nothing),
           "skins[0].inverseBindMatrices: matrix 1 is not finite");
    expect(errorOf(nothing, [](SkinnedMaker& m) { m.document["skins"][0]["joints"] = nlohmann::json::array(); }),
           "skins[0].joints");
    expect(errorOf(nothing, [](SkinnedMaker& m) { m.document["skins"][0]["inverseBindMatrices"] = 0; }),
           "does not hold float MAT4s");
    expect(errorOf(nothing,
                   [](SkinnedMaker& m) {
                       m.document["scenes"][0]["nodes"] = {0};
                   }),
           "skins[0].joints[0]: node 1 is not in the scene of the mesh");
    expect(errorOf([](SkinnedMaker& m) { m.primitive["attributes"]["JOINTS_1"] = 0; }, nothing), "JOINTS_1");
}

TEST(GltfDeformation, SingularAndProjectiveMatricesAreSaid) {
    SkinnedMaker maker;
    maker.inverseBinds[0] = 0.0f;
    maker.inverseBinds[31] = 2.0f;
    maker.build();
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_TRUE(loaded.warnsOf("1 matrices are singular"));
    EXPECT_TRUE(loaded.warnsOf("1 matrices do not end in the row 0 0 0 1"));
    EXPECT_EQ(loaded.only<Skin>().inverseBinds[1][3].w, 1.0f);
}

// Two targets; the second moves nothing. The node's weights win over the mesh's.
GltfMaker morphing() {
    GltfMaker maker;
    nlohmann::json primitive;
    primitive["attributes"]["POSITION"] = maker.addFloats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
    primitive["attributes"]["NORMAL"] = maker.addFloats({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
    const int deltas = maker.addFloats({0, 0, 1, 0, 0, 2, 0, 0, 3}, "VEC3");
    primitive["targets"] = {{{"POSITION", deltas}}, {{"NORMAL", deltas}}};
    maker.addMeshNode(primitive);
    maker.document["meshes"][0]["weights"] = {0.25, 0.5};
    return maker;
}

TEST(GltfDeformation, MorphTargetsArriveOneAfterTheOther) {
    const Loaded loaded = load(morphing());
    ASSERT_TRUE(loaded.file) << loaded.error();
    const auto& geometry = loaded.only<Geometry>();
    ASSERT_EQ(geometry.morphPositions.size(), 6u);
    EXPECT_EQ(geometry.morphPositions[2], glm::vec3(0, 0, 3));
    EXPECT_EQ(geometry.morphPositions[5], glm::vec3(0));
    EXPECT_EQ(geometry.morphNormals[0], glm::vec3(0));
    EXPECT_EQ(geometry.morphNormals[4], glm::vec3(0, 0, 2));
    EXPECT_EQ(loaded.only<MorphWeights>().weights.toVector(), (std::vector<float>{0.25f, 0.5f}));
    GltfMaker own = morphing();
    own.document["nodes"][0]["weights"] = {1.0};
    const Loaded short_ = load(own);
    EXPECT_EQ(short_.only<MorphWeights>().weights.toVector(), (std::vector<float>{1, 0}));
    EXPECT_TRUE(short_.warnsOf("nodes[0].weights: has 1 weights for 2 morph targets"));
}

TEST(GltfDeformation, BrokenMorphTargetsAreRefusedWithTheirPlace) {
    const auto errorOf = [](const std::function<void(GltfMaker&, nlohmann::json&)>& change) {
        GltfMaker maker = morphing();
        change(maker, maker.document["meshes"][0]["primitives"][0]["targets"]);
        return load(maker).error();
    };
    const auto expect = [](const std::string& error, const std::string& text) {
        EXPECT_NE(error.find(text), std::string::npos) << error << "\nlacks " << text;
    };
    expect(errorOf([](GltfMaker&, auto& targets) { targets[0]["POSITION"] = 99; }), "targets[0].POSITION");
    expect(errorOf([](GltfMaker& m, auto& targets) { targets[0]["POSITION"] = m.addFloats({1, 2, 3}, "VEC3"); }),
           "targets[0].POSITION: has 1 elements, POSITION has 3");
    expect(errorOf([](GltfMaker& m, auto& targets) {
               targets[1]["NORMAL"] = m.addFloats({NAN, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC3");
           }),
           "targets[1].NORMAL: element 0 is not finite");
}

TEST(GltfDeformation, AnimatedWeightsHaveAKeyForEachTarget) {
    GltfMaker maker = morphing();
    const int times = maker.addFloats({0, 2}, "SCALAR");
    const int values = maker.addFloats({0, 1, 1, 0}, "SCALAR");
    maker.add("animations", {{"samplers", {{{"input", times}, {"output", values}}}},
                             {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}}}}});
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    const auto& channel = loaded.only<AnimationChannel>();
    EXPECT_EQ(channel.path.get(), AnimationPath::Weights);
    EXPECT_EQ(channel.morph.get().id, loaded.only<MorphWeights>().id());
    EXPECT_EQ(channel.values.size(), 4u);
    maker.document["animations"][0]["samplers"][0]["output"] = times;
    EXPECT_NE(load(maker).error().find("has 2 elements where 4 are needed"), std::string::npos);
}

}  // namespace
}  // namespace umbriel::test
