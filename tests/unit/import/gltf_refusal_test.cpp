#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/unit/import/gltf_maker.h"

namespace umbriel::test {
namespace {

using nlohmann::json;

// Refused as bad input, naming the file and the place, with nothing half-loaded.
void expectRefused(const Loaded& loaded, const std::string& reason) {
    ASSERT_FALSE(loaded.file) << "should be refused: " << reason;
    EXPECT_NE(loaded.error().find(reason), std::string::npos) << loaded.error();
    EXPECT_NE(loaded.error().find("scene.gl"), std::string::npos) << loaded.error();
    EXPECT_EQ(loaded.error().find('\n'), std::string::npos) << loaded.error();
    EXPECT_EQ(loaded.file.error().kind, Error::Kind::BadInput) << loaded.error();
    EXPECT_EQ(loaded.scene->containerCount(), 0u);
    EXPECT_TRUE(loaded.scene->snapshot().empty());
}

struct Refusal {
    const char* name;
    std::function<void(GltfMaker&)> breakIt;
    const char* reason;
};

json& primitive(GltfMaker& m) {
    return m.document["meshes"][0]["primitives"][0];
}
json& accessor(GltfMaker& m, int i) {
    return m.document["accessors"][i];
}
json& node(GltfMaker& m) {
    return m.document["nodes"][0];
}

void addAnimation(GltfMaker& m, const std::vector<float>& times, const std::vector<float>& values, const char* path) {
    const int input = m.addFloats(times, "SCALAR");
    const int output = m.addFloats(values, std::string(path) == "rotation" ? "VEC4" : "VEC3");
    m.add("animations", {{"samplers", {{{"input", input}, {"output", output}}}},
                         {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", path}}}}}}});
}

const std::vector<Refusal> kRefusals = {
    {"AttributeAccessorMissing", [](GltfMaker& m) { primitive(m)["attributes"]["POSITION"] = 7; },
     "meshes[0].primitives[0].attributes.POSITION: accessor 7 does not exist"},
    {"IndexAccessorMissing", [](GltfMaker& m) { primitive(m)["indices"] = 7; },
     "meshes[0].primitives[0].indices: accessor 7 does not exist"},
    {"IndexAccessorNegative", [](GltfMaker& m) { primitive(m)["indices"] = -1; }, "accessor -1 does not exist"},
    {"IndexIsText", [](GltfMaker& m) { primitive(m)["indices"] = "1"; }, "primitives[0].indices: is not an integer"},
    {"IndexIsAFraction", [](GltfMaker& m) { node(m)["mesh"] = 0.5; }, "nodes[0].mesh: 0.5 is not an integer"},
    {"MaterialMissing", [](GltfMaker& m) { primitive(m)["material"] = 0; }, "material 0 does not exist"},
    {"ModeUnknown", [](GltfMaker& m) { primitive(m)["mode"] = 9; }, "primitives[0].mode: 9 is none of"},
    {"MeshMissing", [](GltfMaker& m) { node(m)["mesh"] = 1; }, "nodes[0].mesh: mesh 1 does not exist"},
    {"SceneNodeMissing", [](GltfMaker& m) { m.document["scenes"][0]["nodes"] = {4}; },
     "scenes[0].nodes[0]: node 4 does not"},
    {"VertexIndexTooLarge",
     [](GltfMaker& m) {
         primitive(m)["indices"] = m.addAccessor(std::vector<std::uint8_t>{0, 1, 3}, 5121, "SCALAR");
     },
     "meshes[0].primitives[0].indices: element 2 is 3, there are 3 vertices"},
    {"FloatIndices",
     [](GltfMaker& m) {
         primitive(m)["indices"] = m.addFloats({0, 1, 2}, "SCALAR");
     },
     "does not hold unsigned integers"},
    {"NanPosition",
     [](GltfMaker& m) {
         primitive(m)["attributes"]["POSITION"] =
             m.addFloats({0, 0, 0, 1, std::numeric_limits<float>::quiet_NaN(), 0, 0, 1, 0}, "VEC3");
     },
     "meshes[0].primitives[0].attributes.POSITION: element 1 is not finite"},
    {"InfinitePosition",
     [](GltfMaker& m) {
         primitive(m)["attributes"]["POSITION"] =
             m.addFloats({0, 0, 0, 1, 0, 0, 0, 1, -std::numeric_limits<float>::infinity()}, "VEC3");
     },
     "POSITION: element 2 is not finite"},
    {"NanTexCoord",
     [](GltfMaker& m) {
         primitive(m)["attributes"]["TEXCOORD_0"] = m.addFloats({0, 0, NAN, 0, 0, 1}, "VEC2");
     },
     "TEXCOORD_0: element 1 is not finite"},
    {"UnequalAttributes",
     [](GltfMaker& m) {
         primitive(m)["attributes"]["NORMAL"] = m.addFloats({0, 0, 1}, "VEC3");
     },
     "NORMAL: has 1 elements, POSITION has 3"},
    {"AttributeOfWrongType",
     [](GltfMaker& m) {
         primitive(m)["attributes"]["NORMAL"] = m.addFloats({0, 0, 1, 0, 0, 1}, "VEC2");
     },
     "NORMAL: accessor 2 is not of type VEC3"},
    {"AccessorBeyondView", [](GltfMaker& m) { accessor(m, 0)["count"] = 4; },
     "accessors[0]: needs 48 bytes of buffer view 0, which has 36"},
    {"AccessorCountAbsurd", [](GltfMaker& m) { accessor(m, 0)["count"] = 2147483647; }, "accessors[0]: needs"},
    {"AccessorCountZero", [](GltfMaker& m) { accessor(m, 0)["count"] = 0; }, "accessors[0].count: 0 is out of range"},
    {"AccessorCountHuge", [](GltfMaker& m) { accessor(m, 0)["count"] = 1e300; }, "is out of range"},
    {"AccessorOffsetNegative", [](GltfMaker& m) { accessor(m, 0)["byteOffset"] = -4; }, "accessors[0].byteOffset: -4"},
    {"AccessorUnaligned", [](GltfMaker& m) { accessor(m, 0)["byteOffset"] = 2; },
     "accessors[0].byteOffset: the data is not"},
    {"AccessorTypeUnknown", [](GltfMaker& m) { accessor(m, 0)["type"] = "VEC5"; },
     "accessors[0].type: VEC5 is none of"},
    {"AccessorComponentUnknown", [](GltfMaker& m) { accessor(m, 0)["componentType"] = 5124; },
     "componentType: 5124 is none"},
    {"AccessorZerosHuge",
     [](GltfMaker& m) {
         accessor(m, 0).erase("bufferView");
         accessor(m, 0)["count"] = 2000000000;
     },
     "would take more than"},
    {"ViewBeyondBuffer", [](GltfMaker& m) { m.document["bufferViews"][0]["byteLength"] = 4000; },
     "bufferViews[0]: ends at byte 4000 of buffer 0"},
    {"ViewOverflows", [](GltfMaker& m) { m.document["bufferViews"][0]["byteOffset"] = 2147483647; },
     "bufferViews[0]: ends at"},
    {"ViewStrideSmall", [](GltfMaker& m) { m.document["bufferViews"][0]["byteStride"] = 8; },
     "bufferViews[0].byteStride: 8 does not suit"},
    {"ViewBufferMissing", [](GltfMaker& m) { m.document["bufferViews"][0]["buffer"] = 3; }, "buffer 3 does not exist"},
    {"BufferShorterThanItSays", [](GltfMaker& m) { m.document["buffers"][0]["byteLength"] = 100000; },
     "buffers[0].byteLength: says 100000 bytes"},
    {"SparseIndexTooLarge",
     [](GltfMaker& m) {
         const std::vector<std::uint32_t> index = {3};
         const std::vector<float> value = {1, 2, 3};
         const int indices = m.addView(std::as_bytes(std::span(index)));
         const int values = m.addView(std::as_bytes(std::span(value)));
         accessor(m, 0)["sparse"] = {{"count", 1},
                                     {"indices", {{"bufferView", indices}, {"componentType", 5125}}},
                                     {"values", {{"bufferView", values}}}};
     },
     "accessors[0].sparse.indices: element 0 is 3, the accessor has 3"},
    {"Cycle",
     [](GltfMaker& m) {
         node(m)["children"] = {m.add("nodes", {{"children", {0}}})};
         m.document["scenes"][0]["nodes"] = json::array();
     },
     "nodes[0]: is its own ancestor"},
    {"OwnChild",
     [](GltfMaker& m) {
         node(m)["children"] = {0};
         m.document["scenes"][0]["nodes"] = json::array();
     },
     "nodes[0]: is its own ancestor"},
    {"TwoParents",
     [](GltfMaker& m) {
         const int child = m.add("nodes", {{"name", "child"}});
         node(m)["children"] = {child};
         m.add("nodes", {{"children", {child}}});
     },
     "nodes[2].children[0]: node 1 already has the parent 0"},
    {"SceneNodeNotRoot",
     [](GltfMaker& m) {
         node(m)["children"] = {m.add("nodes", {{"name", "child"}})};
         m.document["scenes"][0]["nodes"].push_back(1);
     },
     "scenes[0].nodes[1]: node 1 is not a root"},
    {"SceneNodeTwice",
     [](GltfMaker& m) {
         m.document["scenes"][0]["nodes"] = {0, 0};
     },
     "names node 0 twice"},
    {"TooDeep",
     [](GltfMaker& m) {
         for (int i = 1; i < 100'003; ++i) {
             m.add("nodes", {{"name", "deep"}});
             m.document["nodes"][i - 1]["children"] = {i};
         }
     },
     "nodes[100001]: lies deeper than 100000 nodes; merge"},
    {"MatrixWithPerspective",
     [](GltfMaker& m) { node(m)["matrix"] = {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; },
     "nodes[0].matrix: its last row"},
    {"MatrixTooShort",
     [](GltfMaker& m) {
         node(m)["matrix"] = {1, 0, 0};
     },
     "nodes[0].matrix: has 3 elements instead of 16"},
    {"TranslationHuge",
     [](GltfMaker& m) {
         node(m)["translation"] = {1e200, 0, 0};
     },
     "nodes[0].translation[0]: 1e+200"},
    {"RotationZero",
     [](GltfMaker& m) {
         node(m)["rotation"] = {0, 0, 0, 0};
     },
     "nodes[0].rotation: the quaternion"},
    {"CameraWithoutLens",
     [](GltfMaker& m) {
         m.add("cameras", {{"type", "perspective"}});
     },
     "cameras[0].perspective: is missing"},
    {"CameraFlat",
     [](GltfMaker& m) {
         node(m)["camera"] = m.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 0}, {"znear", 1}}}});
     },
     "cameras[0].perspective.yfov"},
    {"CameraFarBeforeNear",
     [](GltfMaker& m) {
         node(m)["camera"] =
             m.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 1}, {"zfar", 0.5}}}});
     },
     "cameras[0].perspective.zfar"},
    {"LightMissing", [](GltfMaker& m) { node(m)["extensions"]["KHR_lights_punctual"]["light"] = 0; },
     "nodes[0].extensions.KHR_lights_punctual.light: light 0 does not exist"},
    {"LightNegative",
     [](GltfMaker& m) {
         m.document["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"intensity", -1}}};
     },
     "extensions.KHR_lights_punctual.lights[0].intensity: -1 is out of range"},
    {"SpotInsideOut",
     [](GltfMaker& m) {
         m.document["extensions"]["KHR_lights_punctual"]["lights"] = {
             {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.8}, {"outerConeAngle", 0.4}}}}};
         node(m)["extensions"]["KHR_lights_punctual"]["light"] = 0;
     },
     "innerConeAngle is not below outerConeAngle"},
    {"AnimationKeysDescend",
     [](GltfMaker& m) {
         addAnimation(m, {1, 0}, {0, 0, 0, 1, 1, 1}, "translation");
     },
     "animations[0].channels[0].sampler.input: key 1"},
    {"AnimationValuesMissing",
     [](GltfMaker& m) {
         addAnimation(m, {0, 1}, {0, 0, 0}, "scale");
     },
     "animations[0].channels[0].sampler.output: has 1 elements where 2 are needed"},
    {"AnimationNan",
     [](GltfMaker& m) {
         addAnimation(m, {0}, {0, NAN, 0}, "scale");
     },
     "sampler.output: element 0 is not finite"},
    {"AnimationSamplerMissing",
     [](GltfMaker& m) {
         addAnimation(m, {0}, {0, 0, 0}, "scale");
         m.document["animations"][0]["channels"][0]["sampler"] = 1;
     },
     "animations[0].channels[0].sampler: sampler 1 does not exist"},
    {"RequiredExtensionUnknown",
     [](GltfMaker& m) { m.document["extensionsRequired"] = {"KHR_draco_mesh_compression"}; },
     "extensionsRequired[0]: the file requires KHR_draco_mesh_compression"},
    {"VersionOne", [](GltfMaker& m) { m.document["asset"]["version"] = "1.0"; },
     "asset.version: glTF 1.0 is not supported"},
    {"NoAsset", [](GltfMaker& m) { m.document.erase("asset"); }, "asset: is missing"},
    {"TexturesAreNoArray", [](GltfMaker& m) { m.document["textures"] = "none"; }, "textures: is not a JSON array"},
    {"ChildOfNull", [](GltfMaker& m) { node(m)["children"] = {nullptr}; }, "nodes[0].children[0]: is not an integer"},
};

class GltfRefusal : public testing::TestWithParam<Refusal> {};

TEST_P(GltfRefusal, NamesFileAndPlace) {
    GltfMaker maker = triangle();
    GetParam().breakIt(maker);
    expectRefused(load(maker), GetParam().reason);
}

INSTANTIATE_TEST_SUITE_P(Documents, GltfRefusal, testing::ValuesIn(kRefusals),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(GltfContainer, EveryTruncationIsRefused) {
    GltfMaker maker = triangle();
    maker.add("materials", {{"name", std::string(2000, 'm')}});
    const std::string whole = maker.glb();
    const TempFolder folder;
    for (std::size_t size = 0; size < whole.size(); size += 64) {
        const Loaded loaded(folder.write("scene.glb", whole.substr(0, size)));
        expectRefused(loaded, size == 0 ? "is empty" : size < 20 ? "header" : "truncated");
    }
}

TEST(GltfContainer, DamagedJsonIsRefusedWithItsPlace) {
    const TempFolder folder;
    expectRefused(Loaded(folder.write("scene.gltf", "{\"asset\": {\"version\": \"2.0\"},\n \"nodes\": [}")), "line 2");
    expectRefused(Loaded(folder.write("scene.gltf", "[1]")), "the document: is not a JSON object");
    expectRefused(Loaded(folder.write("scene.gltf", "\xff\xfe garbage")), "the JSON document");
    const std::string deep(100000, '[');
    expectRefused(Loaded(folder.write("scene.gltf", "{\"extras\":" + deep)), "nested too deeply");
}

TEST(GltfFiles, OnlyFilesBelowTheFolderOfTheSceneAreRead) {
    const GltfMaker maker = triangle();
    const std::string bin(reinterpret_cast<const char*>(maker.bin().data()), maker.bin().size());
    const TempFolder outside;
    const std::string secret = outside.write("secret.bin", bin);
    const TempFolder folder;
    folder.write("inside/data.bin", bin);
    ASSERT_EQ(symlink(secret.c_str(), folder.path("link.bin").c_str()), 0);
    ASSERT_EQ(symlink("inside/data.bin", folder.path("good.bin").c_str()), 0);
    ASSERT_EQ(symlink(outside.path("").c_str(), folder.path("folder").c_str()), 0);

    const auto loadWith = [&](const std::string& uri) {
        return Loaded(folder.write("scene.gltf", maker.gltfWithUri(uri)));
    };
    for (const char* fine : {"inside/data.bin", "good.bin", "inside%2Fdata.bin"})
        EXPECT_TRUE(loadWith(fine).file) << fine;
    expectRefused(loadWith(secret), "buffers[0].uri: '" + secret + "' is an absolute path");
    expectRefused(loadWith("../" + std::string("secret.bin")), "leads out of the folder");
    expectRefused(loadWith("inside/../../secret.bin"), "leads out of the folder");
    expectRefused(loadWith("%2e%2e/secret.bin"), "leads out of the folder");
    expectRefused(loadWith("..\\secret.bin"), "leads out of the folder");
    expectRefused(loadWith("file://" + secret), "is not a relative file name");
    expectRefused(loadWith("http://example.com/data.bin"), "is not a relative file name");
    expectRefused(loadWith("link.bin"), "outside the folder");
    expectRefused(loadWith("folder/secret.bin"), "outside the folder");
    expectRefused(loadWith("inside"), "is not a regular file");
    expectRefused(loadWith("absent.bin"), "buffers[0].uri: cannot read 'absent.bin': No such file");
    expectRefused(loadWith("bad%zz.bin"), "percent");
    expectRefused(loadWith("nul%00.bin"), "control characters");
}

}  // namespace
}  // namespace umbriel::test
