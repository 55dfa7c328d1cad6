#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "common/scene/cameras.h"
#include "common/scene/lights.h"
#include "common/scene/materials.h"
#include "common/scene/traversal.h"
#include "tests/unit/import/gltf_maker.h"

namespace umbriel::test {
namespace {

using nlohmann::json;

// 2 x 2 texels: red, green / blue, white.
constexpr const char* kPngUri =
    "data:image/png;base64,"
    "iVBORw0KGgoAAAANSUhEUgAAAAIAAAACCAIAAAD91JpzAAAAEklEQVR4nGP4z8DAAMIM/4EAAB/uBfsL2WiLAAAAAE"
    "lFTkSuQmCC";

json& nodeOf(GltfMaker& maker) {
    return maker.document["nodes"][0];
}

const Transform& transformOf(const Loaded& loaded) {
    return loaded.only<Transform>();
}

TEST(GltfNodes, TranslationKeepsDoublePrecision) {
    GltfMaker maker = triangle();
    nodeOf(maker)["translation"] = {1000000.0001, -2.5, 1e-9};
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(transformOf(loaded).translation.get(), glm::dvec3(1000000.0001, -2.5, 1e-9));
}

TEST(GltfNodes, AChainAsDeepAsTheLimitLoadsAndStandsWhereItsStepsLead) {
    constexpr int kDepth = 100'000;
    GltfMaker maker = triangle();
    auto& nodes = maker.document["nodes"];
    for (int i = 1; i <= kDepth; ++i) {
        nodes.push_back({{"translation", {0.5, 0, 0}}});
        nodes[static_cast<std::size_t>(i) - 1]["children"] = {i};
    }
    nodes[kDepth]["mesh"] = nodes[0]["mesh"];
    nodes[0].erase("mesh");
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    int drawn = 0;
    traverse(*loaded.scene, loaded.root().root, std::nullopt, [&](const VisitedNode& visited) {
        if (visited.core && isA<Geometry>(*visited.core)) {
            ++drawn;
            EXPECT_EQ(visited.worldFromNode.translation, glm::dvec3(0.5 * kDepth, 0, 0));
        }
        return Descend::Yes;
    });
    EXPECT_EQ(drawn, 1);
}

TEST(GltfNodes, RotationAndScaleAreTheirProduct) {
    GltfMaker maker = triangle();
    const double half = std::sqrt(0.5);
    nodeOf(maker)["rotation"] = {0, 0, half, half};  // a quarter turn about z: x to y
    nodeOf(maker)["scale"] = {2, 3, -4};
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    const glm::mat3 linear = transformOf(loaded).linear;
    const glm::mat3 expected(glm::vec3(0, 2, 0), glm::vec3(-3, 0, 0), glm::vec3(0, 0, -4));
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row) EXPECT_NEAR(linear[column][row], expected[column][row], 1e-6f);
}

TEST(GltfNodes, MatrixIsTakenColumnByColumn) {
    GltfMaker maker = triangle();
    nodeOf(maker)["matrix"] = {1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 10, 0, 0.1, 0.2, 0.3, 1};
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(transformOf(loaded).linear.get(), glm::mat3(1, 2, 3, 4, 5, 6, 7, 8, 10));
    EXPECT_EQ(transformOf(loaded).translation.get(), glm::dvec3(0.1, 0.2, 0.3));
}

TEST(GltfNodes, ARotationNotOfUnitLengthIsRepairedWithAWarning) {
    GltfMaker maker = triangle();
    nodeOf(maker)["rotation"] = {0, 0, 0, 2};
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(transformOf(loaded).linear.get(), glm::mat3(1.0f));
    EXPECT_TRUE(loaded.warnsOf("nodes[0].rotation"));
}

TEST(GltfNodes, TheDefaultSceneIsLoadedAndOthersAreNamed) {
    GltfMaker maker = triangle();
    maker.document["nodes"].push_back({{"name", "other"}, {"mesh", 0}});
    maker.document["scenes"].push_back({{"name", "second"}, {"nodes", {1}}});
    maker.document["scene"] = 1;
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(loaded.scene->get(loaded.root().root.get()).name.get(), "second");
    EXPECT_EQ(loaded.count<Transform>(), 1u);
    EXPECT_TRUE(loaded.warnsOf("2 scenes"));
}

TEST(GltfNodes, AFileWithoutScenesShowsAllItsRoots) {
    GltfMaker maker = triangle();
    maker.document.erase("scenes");
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(loaded.count<Geometry>(), 1u);
}

TEST(GltfNodes, AnEmptyFileIsAScene) {
    GltfMaker maker;
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_TRUE(loaded.warnsOf("nothing to draw"));
    EXPECT_TRUE(loaded.root().root.get());
}

TEST(GltfCameras, KeepTheOrderOfTheFileAndUnnamedOnesAreCounted) {
    GltfMaker maker = triangle();
    maker.add("cameras",
              {{"type", "perspective"}, {"perspective", {{"yfov", 0.7}, {"znear", 0.1}, {"aspectRatio", 1.5}}}});
    maker.add("cameras", {{"type", "orthographic"},
                          {"name", "top"},
                          {"orthographic", {{"xmag", 3}, {"ymag", 2}, {"znear", 0.5}, {"zfar", 50}}}});
    const int second = maker.add("nodes", {{"camera", 1}});
    const int first = maker.add("nodes", {{"camera", 0}, {"translation", {0, 0, 9}}});
    maker.document["scenes"][0]["nodes"].push_back(second);
    maker.document["scenes"][0]["nodes"].push_back(first);
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    ASSERT_EQ(loaded.root().cameras.size(), 2u);
    const auto* perspective = loaded.scene->findAs<PerspectiveCamera>(loaded.root().cameras[0]);
    const auto* orthographic = loaded.scene->findAs<OrthographicCamera>(loaded.root().cameras[1]);
    ASSERT_TRUE(perspective && orthographic);
    EXPECT_EQ(perspective->name.get(), "camera 0");
    EXPECT_EQ(perspective->fovY.get(), 0.7);
    EXPECT_EQ(perspective->aspect.get(), 1.5);
    EXPECT_EQ(perspective->nearDistance.get(), 0.1);
    EXPECT_EQ(perspective->farDistance.get(), 0.0) << "infinite";
    EXPECT_EQ(orthographic->name.get(), "top");
    EXPECT_EQ(orthographic->halfWidth.get(), 3.0);
    EXPECT_EQ(orthographic->farDistance.get(), 50.0);
    const Node& beacon = loaded.scene->get(perspective->beacon.get());
    EXPECT_EQ(loaded.scene->findAs<Transform>(beacon.core.get())->translation.get(), glm::dvec3(0, 0, 9));
}

// --camera finds them by name: an unnamed one has its node's, and none has that of another.
TEST(GltfCameras, EveryOneHasANameOfItsOwn) {
    GltfMaker maker = triangle();
    for (const char* name : {"", "eye", "eye"}) {
        json camera = {{"type", "perspective"}, {"perspective", {{"yfov", 0.7}, {"znear", 0.1}}}};
        if (*name) camera["name"] = name;
        maker.add("cameras", camera);
    }
    for (const auto& [camera, name] : {std::pair{0, "south"}, {0, ""}, {0, "south"}, {1, "a"}, {2, "b"}, {2, "c"}}) {
        json node = {{"camera", camera}};
        if (*name) node["name"] = name;
        maker.document["scenes"][0]["nodes"].push_back(maker.add("nodes", node));
    }
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    std::vector<std::string> names;
    for (std::size_t i = 0; i < loaded.root().cameras.size(); ++i)
        names.push_back(loaded.scene->findAs<PerspectiveCamera>(loaded.root().cameras[i])->name.get());
    EXPECT_EQ(names, (std::vector<std::string>{"south", "camera 1", "south 2", "eye", "eye 2", "eye 3"}));
}

TEST(GltfLights, StandAboveTheWholeSceneAtTheirBeacons) {
    GltfMaker maker = triangle();
    maker.document["extensionsUsed"] = {"KHR_lights_punctual"};
    maker.document["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "directional"}, {"intensity", 3}, {"color", {1, 0.5, 0}}},
        {{"type", "spot"},
         {"name", "lamp"},
         {"intensity", 10},
         {"range", 7},
         {"spot", {{"innerConeAngle", 0.2}, {"outerConeAngle", 0.6}}}},
        {{"type", "point"}, {"intensity", 5}}};
    for (int i = 0; i < 3; ++i) {
        const int node = maker.add("nodes", {{"name", "n" + std::to_string(i)}});
        maker.document["nodes"][node]["extensions"]["KHR_lights_punctual"]["light"] = i;
        maker.document["scenes"][0]["nodes"].push_back(node);
    }
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_TRUE(loaded.file->warnings.empty());
    // root -> sun -> lamp -> bulb -> scene, which holds the geometry.
    const Aspect& scene = *loaded.scene;
    const Node* node = scene.find(loaded.root().root.get());
    const auto* sun = scene.findAs<DirectionalLight>(node->core.get());
    ASSERT_TRUE(sun);
    EXPECT_EQ(sun->irradiance.get(), glm::vec3(3, 1.5f, 0)) << "unscaled";
    EXPECT_EQ(scene.get(sun->beacon.get()).name.get(), "n0");
    node = scene.find(node->children[0]);
    const auto* lamp = scene.findAs<SpotLight>(node->core.get());
    ASSERT_TRUE(lamp);
    EXPECT_EQ(lamp->name.get(), "lamp");
    EXPECT_EQ(lamp->range.get(), 7.0f);
    EXPECT_EQ(lamp->innerAngle.get(), 0.2f);
    EXPECT_EQ(lamp->outerAngle.get(), 0.6f);
    node = scene.find(node->children[0]);
    const auto* bulb = scene.findAs<PointLight>(node->core.get());
    ASSERT_TRUE(bulb);
    EXPECT_EQ(bulb->intensity.get(), glm::vec3(5));
    EXPECT_EQ(bulb->range.get(), 0.0f) << "never ends";
    node = scene.find(node->children[0]);
    EXPECT_EQ(node->children.size(), 4u);
}

TEST(GltfMaterials, FactorsTexturesSamplersAndTransformsArrive) {
    GltfMaker maker = triangle();
    maker.document["extensionsUsed"] = {"KHR_texture_transform", "KHR_materials_emissive_strength"};
    maker.document["extensionsRequired"] = {"KHR_texture_transform"};
    maker.add("images", {{"uri", kPngUri}});
    maker.add("samplers", {{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}, {"minFilter", 9986}});
    maker.add("textures", {{"source", 0}, {"sampler", 0}});
    maker.add("textures", {{"source", 0}});
    json material = {{"name", "paint"},
                     {"pbrMetallicRoughness",
                      {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}}, {"metallicFactor", 0.25}, {"roughnessFactor", 0.75}}},
                     {"normalTexture", {{"index", 1}, {"scale", 0.5}, {"texCoord", 1}}},
                     {"emissiveFactor", {1, 0.5, 0}},
                     {"alphaMode", "MASK"},
                     {"alphaCutoff", 0.3},
                     {"doubleSided", true}};
    material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 4;
    json& base = material["pbrMetallicRoughness"]["baseColorTexture"];
    base["index"] = 0;
    base["extensions"]["KHR_texture_transform"] = {{"offset", {0.5, 0.25}}, {"rotation", 1.5}, {"scale", {2, 3}}};
    maker.document["meshes"][0]["primitives"][0]["material"] = maker.add("materials", material);
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_TRUE(loaded.file->warnings.empty()) << loaded.file->warnings[0];

    const auto& paint = loaded.only<Material>();
    EXPECT_EQ(paint.model.get(), ReflectionModel::MetallicRoughness);
    EXPECT_EQ(paint.baseColour.get(), glm::vec4(0.1f, 0.2f, 0.3f, 0.4f));
    EXPECT_EQ(paint.metallic.get(), 0.25f);
    EXPECT_EQ(paint.roughness.get(), 0.75f);
    EXPECT_EQ(paint.normalScale.get(), 0.5f);
    EXPECT_EQ(paint.emission.get(), glm::vec3(4, 2, 0));
    EXPECT_EQ(paint.alphaMode.get(), AlphaMode::Mask);
    EXPECT_EQ(paint.alphaCutoff.get(), 0.3f);
    EXPECT_TRUE(paint.doubleSided.get());
    const Texture& colour = loaded.scene->get(paint.baseColourTexture.get());
    EXPECT_EQ(colour.offset.get(), glm::vec2(0.5f, 0.25f));
    EXPECT_EQ(colour.rotation.get(), 1.5f);
    EXPECT_EQ(colour.scale.get(), glm::vec2(2, 3));
    EXPECT_EQ(colour.wrapS.get(), WrapMode::ClampToEdge);
    EXPECT_EQ(colour.wrapT.get(), WrapMode::MirroredRepeat);
    EXPECT_EQ(colour.magFilter.get(), FilterMode::Nearest);
    EXPECT_EQ(colour.minFilter.get(), FilterMode::Nearest);
    EXPECT_EQ(colour.mipMode.get(), MipMode::Linear);
    const Texture& normal = loaded.scene->get(paint.normalTexture.get());
    EXPECT_EQ(normal.texCoordSet.get(), 1u);
    EXPECT_EQ(normal.wrapS.get(), WrapMode::Repeat);
    EXPECT_EQ(normal.mipMode.get(), MipMode::Linear);
    EXPECT_EQ(loaded.count<Image>(), 1u) << "one picture for both";
    EXPECT_EQ(colour.image.get(), normal.image.get());
    const Image& image = loaded.only<Image>();
    EXPECT_EQ(image.width.get(), 2u);
    EXPECT_EQ(image.height.get(), 2u);
    EXPECT_EQ(image.format.get(), TexelFormat::RGB8);
    EXPECT_EQ(image.texels.size(), 12u);
    EXPECT_EQ(image.texels[0], 255) << "the first texel of the first row is red";
    EXPECT_EQ(image.texels[1], 0);
}

TEST(GltfMaterials, FactorsOutOfRangeAreClampedWithAWarning) {
    GltfMaker maker = triangle();
    maker.document["meshes"][0]["primitives"][0]["material"] = maker.add(
        "materials",
        {{"pbrMetallicRoughness", {{"metallicFactor", 1.5}, {"roughnessFactor", -1}}}, {"emissiveFactor", {10, 0, 0}}});
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(loaded.only<Material>().metallic.get(), 1.0f);
    EXPECT_EQ(loaded.only<Material>().roughness.get(), 0.0f);
    EXPECT_EQ(loaded.only<Material>().emission.get(), glm::vec3(10, 0, 0)) << "radiance has no upper bound";
    EXPECT_TRUE(loaded.warnsOf("materials[0].pbrMetallicRoughness.metallicFactor"));
    EXPECT_TRUE(loaded.warnsOf("materials[0].pbrMetallicRoughness.roughnessFactor"));
}

TEST(GltfMaterials, UnlitIsAModelAndNoMaterialIsTheDefaultOne) {
    GltfMaker maker = triangle();
    EXPECT_EQ(load(maker).only<Material>().metallic.get(), 1.0f);
    json material;
    material["extensions"]["KHR_materials_unlit"] = json::object();
    maker.document["meshes"][0]["primitives"][0]["material"] = maker.add("materials", material);
    EXPECT_EQ(load(maker).only<Material>().model.get(), ReflectionModel::Unlit);
}

TEST(GltfMaterials, ABrokenOrMissingPictureCostsTheTextureOnly) {
    for (const char* uri :
         {"missing.png", "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAA", "data:text/plain;base64,AAAA"}) {
        GltfMaker maker = triangle();
        maker.add("images", {{"uri", uri}});
        maker.add("textures", {{"source", 0}});
        json material;
        material["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 0;
        maker.document["meshes"][0]["primitives"][0]["material"] = maker.add("materials", material);
        const Loaded loaded = load(maker);
        ASSERT_TRUE(loaded.file) << loaded.error();
        EXPECT_FALSE(loaded.only<Material>().baseColourTexture.get());
        EXPECT_TRUE(loaded.warnsOf("images[0]")) << uri;
        EXPECT_EQ(loaded.count<Image>(), 0u);
    }
}

TEST(GltfMaterials, AHugePictureIsRefusedBeforeItIsDecoded) {
    // A PNG header that promises 20000 x 1000 texels.
    std::string png("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x4e\x20\0\0\x03\xe8\x08\x02\0\0\0", 29);
    png += std::string("\x87\x12\x34\x56\0\0\0\0IDAT", 12);
    GltfMaker maker = triangle();
    const int view = maker.addView(std::as_bytes(std::span(png)));
    maker.add("images", {{"bufferView", view}, {"mimeType", "image/png"}});
    maker.add("textures", {{"source", 0}});
    json material;
    material["emissiveTexture"]["index"] = 0;
    maker.document["meshes"][0]["primitives"][0]["material"] = maker.add("materials", material);
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_TRUE(loaded.warnsOf("20000 x 1000")) << (loaded.file->warnings.empty() ? "" : loaded.file->warnings[0]);
}

TEST(GltfAnimations, KeysInterpolationsAndPosesArrive) {
    GltfMaker maker = triangle();
    nodeOf(maker)["translation"] = {1, 2, 3};
    nodeOf(maker)["rotation"] = {0, 1, 0, 0};
    const int times = maker.addFloats({0, 1, 2.5f}, "SCALAR");
    const int moves = maker.addFloats({0, 0, 0, 1, 0, 0, 2, 0, 0}, "VEC3");
    const int turns = maker.addFloats({0, 0, 0, 1, 0, 0, 2, 0, 0, 1, 0, 0}, "VEC4");
    std::vector<float> spline(27);
    for (std::size_t i = 0; i < spline.size(); ++i) spline[i] = static_cast<float>(i);
    const int scales = maker.addFloats(spline, "VEC3");
    const auto channel = [](int sampler, const char* path) {
        return json{{"sampler", sampler}, {"target", {{"node", 0}, {"path", path}}}};
    };
    maker.add("animations", {{"name", "walk"},
                             {"samplers",
                              {{{"input", times}, {"output", moves}, {"interpolation", "STEP"}},
                               {{"input", times}, {"output", turns}},
                               {{"input", times}, {"output", scales}, {"interpolation", "CUBICSPLINE"}}}},
                             {"channels", {channel(0, "translation"), channel(1, "rotation"), channel(2, "scale")}}});
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    ASSERT_EQ(loaded.root().animations.size(), 1u);
    const Animation& walk = loaded.scene->get(loaded.root().animations[0]);
    EXPECT_EQ(walk.name.get(), "walk");
    EXPECT_EQ(walk.duration.get(), 2.5);
    ASSERT_EQ(walk.channels.size(), 3u);
    const AnimationChannel& move = loaded.scene->get(walk.channels[0]);
    EXPECT_EQ(move.path.get(), AnimationPath::Translation);
    EXPECT_EQ(move.interpolation.get(), AnimationInterpolation::Step);
    EXPECT_EQ(move.times.toVector(), (std::vector<float>{0, 1, 2.5f}));
    EXPECT_EQ(move.values[6], 2.0f);
    const AnimationChannel& turn = loaded.scene->get(walk.channels[1]);
    EXPECT_EQ(turn.interpolation.get(), AnimationInterpolation::Linear);
    EXPECT_EQ(turn.values[6], 1.0f) << "normalised";
    EXPECT_TRUE(loaded.warnsOf("normalised"));
    const AnimationChannel& scale = loaded.scene->get(walk.channels[2]);
    EXPECT_EQ(scale.interpolation.get(), AnimationInterpolation::CubicSpline);
    EXPECT_EQ(scale.values.size(), 27u);
    EXPECT_EQ(loaded.count<AnimatedPose>(), 1u) << "one node, one pose";
    const AnimatedPose& pose = loaded.only<AnimatedPose>();
    EXPECT_EQ(pose.translation.get(), glm::dvec3(1, 2, 3));
    EXPECT_EQ(pose.rotation.get(), glm::vec4(0, 1, 0, 0));
    EXPECT_EQ(pose.target.get().id, transformOf(loaded).id());
}

}  // namespace
}  // namespace umbriel::test
