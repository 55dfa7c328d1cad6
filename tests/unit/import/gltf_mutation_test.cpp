#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "client/import/gltf_import.h"
#include "client/import/validate.h"
#include "tests/unit/import/gltf_maker.h"

// Damaged files, in this process, so that sanitizers see what the importer does.

namespace umbriel::test {
namespace {

using nlohmann::json;

// A little of everything the importer reads.
GltfMaker everything() {
    GltfMaker maker = triangle();
    const int normals = maker.addFloats({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
    const int tangents = maker.addFloats({1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}, "VEC4");
    const int coordinates =
        maker.addAccessor(std::vector<std::uint8_t>{0, 0, 0, 0, 255, 0, 0, 0, 0, 255, 0, 0}, 5121, "VEC2", true);
    maker.document["bufferViews"].back()["byteStride"] = 4;
    maker.document["accessors"].back()["count"] = 3;
    const std::vector<std::uint16_t> replaced = {1};
    const std::vector<float> replacement = {7, 8, 9};
    const int sparseIndices = maker.addView(std::as_bytes(std::span(replaced)));
    const int sparseValues = maker.addView(std::as_bytes(std::span(replacement)));
    maker.document["accessors"][0]["sparse"] = {{"count", 1},
                                                {"indices", {{"bufferView", sparseIndices}, {"componentType", 5123}}},
                                                {"values", {{"bufferView", sparseValues}}}};
    json& primitive = maker.document["meshes"][0]["primitives"][0];
    primitive["attributes"].update({{"NORMAL", normals}, {"TANGENT", tangents}, {"TEXCOORD_0", coordinates}});
    primitive["mode"] = 4;
    primitive["material"] = maker.add(
        "materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}}, {"metallicFactor", 0.25}}},
                      {"alphaCutoff", 0.3}});
    maker.document["nodes"][0].update({{"translation", {1, 2, 3}}, {"rotation", {0, 0, 0, 1}}, {"scale", {1, 1, 1}}});
    maker.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 0.7}, {"znear", 0.1}, {"zfar", 9}}}});
    maker.document["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.2}, {"outerConeAngle", 0.6}}}}};
    const int child = maker.add("nodes", {{"camera", 0}, {"mesh", 0}});
    maker.document["nodes"][child]["extensions"]["KHR_lights_punctual"]["light"] = 0;
    maker.document["nodes"][0]["children"] = {child};
    const int times = maker.addFloats({0, 1}, "SCALAR");
    const int turns = maker.addFloats({0, 0, 0, 1, 0, 0, 1, 0}, "VEC4");
    maker.add("animations", {{"samplers", {{{"input", times}, {"output", turns}, {"interpolation", "LINEAR"}}}},
                             {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "rotation"}}}}}}});
    return maker;
}

// True when it loaded. What loads must pass the client's validation.
bool importsOrRefuses(const TempFolder& folder, const std::string& content) {
    const std::string file = folder.write("scene.glb", content);
    TypeRegistry types;
    registerCoreTypes(types);
    IdSource ids;
    Aspect scene(types, ids);
    ImportWarnings warnings;
    ImportLimits limits;
    limits.sceneBytes = 16 << 20;
    try {
        const Ref<LoadedScene> loaded = importGltf(file, scene, limits, warnings);
        const auto valid = validateLoadedScene(scene, loaded, treeLimits(limits));
        RC_ASSERT(!valid.has_error());
        return true;
    } catch (const ImportRefused&) {
        return false;
    }
}

TEST(GltfMutation, TheWholeFileLoads) {
    const TempFolder folder;
    const Loaded loaded(folder.write("scene.glb", everything().glb()));
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_TRUE(loaded.file->warnings.empty()) << loaded.file->warnings[0];
    EXPECT_EQ(loaded.count<AnimationChannel>(), 1u);
}

RC_GTEST_PROP(GltfMutation, OtherNumbersAreRefusedOrGiveAValidScene, ()) {
    static const GltfMaker whole = everything();
    static const TempFolder folder;
    GltfMaker maker = whole;
    // Every number of the document, by its place.
    std::vector<std::string> places;
    const json flat = whole.document.flatten();
    for (const auto& [place, value] : flat.items())
        if (value.is_number()) places.push_back(place);
    const auto changes = *rc::gen::inRange(1, 4);
    for (int i = 0; i < changes; ++i) {
        const std::string place = *rc::gen::elementOf(places);
        const json value =
            *rc::gen::element<json>(-1, 0, 1, 2, 3, 4, 5, 7, 36, 255, 5120, 5121, 5126, 65536, 2147483647, 4294967296,
                                    -2147483648, 0.5, -0.5, 1e-40, 1e38, -1e300, nullptr, "x");
        maker.document[json::json_pointer(place)] = value;
    }
    importsOrRefuses(folder, maker.glb());
}

RC_GTEST_PROP(GltfMutation, OtherBytesAreRefusedOrGiveAValidScene, ()) {
    static const std::string whole = everything().glb();
    static const TempFolder folder;
    std::string content = whole;
    const auto changes = *rc::gen::inRange(1, 8);
    for (int i = 0; i < changes; ++i)
        content[*rc::gen::inRange<std::size_t>(0, content.size())] = static_cast<char>(*rc::gen::inRange(0, 256));
    importsOrRefuses(folder, content);
}

}  // namespace
}  // namespace umbriel::test
