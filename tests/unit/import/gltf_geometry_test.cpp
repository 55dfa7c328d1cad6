#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "common/scene/materials.h"
#include "tests/unit/import/gltf_maker.h"

namespace umbriel::test {
namespace {

using Indices = std::vector<std::uint32_t>;

GltfMaker meshOf(const std::vector<float>& positions, nlohmann::json primitive = nlohmann::json::object()) {
    GltfMaker maker;
    primitive["attributes"]["POSITION"] = maker.addFloats(positions, "VEC3");
    maker.addMeshNode(primitive);
    return maker;
}

nlohmann::json& primitiveOf(GltfMaker& maker) {
    return maker.document["meshes"][0]["primitives"][0];
}

const std::vector<float> kFive = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 2, 1, 0};

TEST(GltfGeometry, TriangleArrivesBitForBit) {
    const Loaded loaded = load(triangle());
    ASSERT_TRUE(loaded.file) << loaded.error();
    const auto& geometry = loaded.only<Geometry>();
    EXPECT_EQ(geometry.positions.toVector(), (std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(geometry.indices.toVector(), (Indices{0, 1, 2}));
    EXPECT_TRUE(geometry.normals.empty()) << "missing normals stay missing: the renderer takes the face's";
    EXPECT_TRUE(loaded.file->warnings.empty());
    EXPECT_GE(geometry.id().value, 100u) << "ids come from the application's source";
}

TEST(GltfGeometry, TextFormWithDataUriAndWithBinFileGivesTheSameScene) {
    const GltfMaker maker = triangle();
    const TempFolder folder;
    folder.write("my data.bin", std::string(reinterpret_cast<const char*>(maker.bin().data()), maker.bin().size()));
    const Loaded binary(folder.write("a.glb", maker.glb()));
    for (const std::string& text :
         {maker.gltf(), maker.gltfWithUri("my%20data.bin"), maker.gltfWithUri("./my data.bin")}) {
        const Loaded loaded(folder.write("a.gltf", text));
        ASSERT_TRUE(loaded.file) << loaded.error();
        EXPECT_TRUE(loaded.only<Geometry>().positions.storage().equals(binary.only<Geometry>().positions.storage()));
    }
}

TEST(GltfGeometry, StripsAndFansBecomeLists) {
    const Loaded strip = load(meshOf(kFive, {{"mode", 5}}));
    EXPECT_EQ(strip.only<Geometry>().indices.toVector(), (Indices{0, 1, 2, 1, 3, 2, 2, 3, 4}));
    const Loaded fan = load(meshOf(kFive, {{"mode", 6}}));
    EXPECT_EQ(fan.only<Geometry>().indices.toVector(), (Indices{1, 2, 0, 2, 3, 0, 3, 4, 0}));
}

TEST(GltfGeometry, AllIndexTypesGiveTheSameTriangles) {
    const Indices expected = {0, 2, 1, 1, 2, 3};
    GltfMaker bytes = meshOf(kFive);
    primitiveOf(bytes)["indices"] = bytes.addAccessor(std::vector<std::uint8_t>{0, 2, 1, 1, 2, 3}, 5121, "SCALAR");
    EXPECT_EQ(load(bytes).only<Geometry>().indices.toVector(), expected);
    GltfMaker shorts = meshOf(kFive);
    primitiveOf(shorts)["indices"] = shorts.addAccessor(std::vector<std::uint16_t>{0, 2, 1, 1, 2, 3}, 5123, "SCALAR");
    EXPECT_EQ(load(shorts).only<Geometry>().indices.toVector(), expected);
    GltfMaker ints = meshOf(kFive);
    primitiveOf(ints)["indices"] = ints.addAccessor(expected, 5125, "SCALAR");
    EXPECT_EQ(load(ints).only<Geometry>().indices.toVector(), expected);
}

TEST(GltfGeometry, MissingIndicesCountUpAndAnIncompleteTriangleIsDropped) {
    const Loaded loaded = load(meshOf(kFive));
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(loaded.only<Geometry>().indices.toVector(), (Indices{0, 1, 2}));
    EXPECT_TRUE(loaded.warnsOf("meshes[0].primitives[0]: the last triangle is incomplete"));
}

TEST(GltfGeometry, PointsAndLinesAreLeftOutWithAWarning) {
    for (const int mode : {0, 1, 2, 3}) {
        const Loaded loaded = load(meshOf(kFive, {{"mode", mode}}));
        ASSERT_TRUE(loaded.file) << loaded.error();
        EXPECT_EQ(loaded.count<Geometry>(), 0u);
        EXPECT_TRUE(loaded.warnsOf("points and lines are not drawn"));
        EXPECT_TRUE(loaded.warnsOf("nothing to draw"));
    }
}

TEST(GltfGeometry, SparseValuesReplaceTheBase) {
    GltfMaker maker = triangle();
    const std::vector<std::uint16_t> replaced = {1};
    const std::vector<float> replacement = {7, 8, 9};
    const int indices = maker.addView(std::as_bytes(std::span(replaced)));
    const int values = maker.addView(std::as_bytes(std::span(replacement)));
    const nlohmann::json sparse = {{"count", 1},
                                   {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
                                   {"values", {{"bufferView", values}}}};
    maker.document["accessors"][0]["sparse"] = sparse;
    EXPECT_EQ(load(maker).only<Geometry>().positions[1], glm::vec3(7, 8, 9));
    EXPECT_EQ(load(maker).only<Geometry>().positions[2], glm::vec3(0, 1, 0));
    // Without a buffer view the base is zeros.
    maker.document["accessors"][0].erase("bufferView");
    EXPECT_EQ(load(maker).only<Geometry>().positions[1], glm::vec3(7, 8, 9));
    EXPECT_EQ(load(maker).only<Geometry>().positions[2], glm::vec3(0, 0, 0));
}

TEST(GltfGeometry, InterleavedAttributesAreTakenApart) {
    GltfMaker maker;
    std::vector<float> vertices;
    for (int i = 0; i < 3; ++i) vertices.insert(vertices.end(), {float(i), 10.0f + i, 20.0f + i, 0, 0, 1});
    const int view = maker.addView(std::as_bytes(std::span(vertices)), 24);
    nlohmann::json accessor = {{"bufferView", view}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}};
    const int positions = maker.add("accessors", accessor);
    accessor["byteOffset"] = 12;
    const int normals = maker.add("accessors", accessor);
    maker.addMeshNode({{"attributes", {{"POSITION", positions}, {"NORMAL", normals}}}});
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(loaded.only<Geometry>().positions[2], glm::vec3(2, 12, 22));
    EXPECT_EQ(loaded.only<Geometry>().normals[2], glm::vec3(0, 0, 1));
}

TEST(GltfGeometry, QuantisedAttributesAreScaled) {
    GltfMaker maker;
    const int positions = maker.addAccessor(
        std::vector<std::int16_t>{0, 0, 0, 0, 32767, 0, -32768, 16384, 100, 0, 0, 0}, 5122, "VEC4", true);
    maker.document["accessors"][positions]["type"] = "VEC3";  // three of the four shorts, eight bytes apart
    maker.document["bufferViews"][0]["byteStride"] = 8;
    const int coordinates = maker.addAccessor(std::vector<std::uint8_t>{0, 255, 51, 102, 0, 0}, 5121, "VEC2", true);
    maker.document["extensionsUsed"] = {"KHR_mesh_quantization"};
    maker.document["extensionsRequired"] = {"KHR_mesh_quantization"};
    maker.document["bufferViews"][1].erase("byteStride");
    maker.addMeshNode({{"attributes", {{"POSITION", positions}, {"TEXCOORD_0", coordinates}}}});
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    const auto& geometry = loaded.only<Geometry>();
    EXPECT_EQ(geometry.positions[1], glm::vec3(1, 0, -1)) << "-32768 is -1, too";
    EXPECT_EQ(geometry.positions[2].x, 100.0f / 32767.0f);
    EXPECT_EQ(geometry.texCoords0[0], glm::vec2(0, 1));
    EXPECT_EQ(geometry.texCoords0[1], glm::vec2(51.0f / 255.0f, 102.0f / 255.0f));

    maker.document["accessors"][positions].erase("normalized");
    EXPECT_EQ(load(maker).only<Geometry>().positions[1], glm::vec3(32767, 0, -32768));
}

TEST(GltfGeometry, ColoursWithoutAlphaAreOpaque) {
    GltfMaker maker = triangle();
    primitiveOf(maker)["attributes"]["COLOR_0"] = maker.addAccessor(
        std::vector<std::uint16_t>{65535, 0, 0, 0, 0, 65535, 0, 0, 0, 0, 65535, 0}, 5123, "VEC4", true);
    EXPECT_EQ(load(maker).only<Geometry>().colours[1], glm::vec4(0, 1, 0, 0));
    primitiveOf(maker)["attributes"]["COLOR_0"] = maker.addFloats({1, 0, 0, 0, 0.5f, 0, 0, 0, 1}, "VEC3");
    EXPECT_EQ(load(maker).only<Geometry>().colours[1], glm::vec4(0, 0.5f, 0, 1));
}

TEST(GltfGeometry, NormalsWithoutDirectionBecomeThoseOfTheirTriangles) {
    GltfMaker maker = triangle();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    primitiveOf(maker)["attributes"]["NORMAL"] = maker.addFloats({0, 0, 0, nan, 0, 0, 0, 3, 4}, "VEC3");
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(loaded.only<Geometry>().normals[0], glm::vec3(0, 0, 1));
    EXPECT_EQ(loaded.only<Geometry>().normals[1], glm::vec3(0, 0, 1));
    EXPECT_EQ(loaded.only<Geometry>().normals[2], glm::vec3(0, 0.6f, 0.8f));
    EXPECT_TRUE(loaded.warnsOf("2 normals have no direction"));
}

TEST(GltfGeometry, AMeshOfManyNodesIsOneGeometry) {
    GltfMaker maker = triangle();
    for (int i = 0; i < 3; ++i) maker.document["scenes"][0]["nodes"].push_back(maker.add("nodes", {{"mesh", 0}}));
    const Loaded loaded = load(maker);
    ASSERT_TRUE(loaded.file) << loaded.error();
    EXPECT_EQ(loaded.count<Geometry>(), 1u);
    std::size_t users = 0;
    for (const ContainerId id : loaded.scene->ids())
        if (const Node* node = loaded.scene->findAs<Node>(id))
            users += node->core.get().id == loaded.only<Geometry>().id();
    EXPECT_EQ(users, 4u);
}

TEST(GltfGeometry, MeshesThatDifferInMaterialOnlyShareTheirMemory) {
    GltfMaker maker = triangle();
    nlohmann::json primitive = primitiveOf(maker);
    primitive["material"] = maker.add("materials", {{"name", "red"}});
    maker.addMeshNode(primitive);
    maker.addMeshNode(primitive);
    // Large enough to be a blob on its way: 32 KiB and more.
    const Loaded small = load(maker);
    ASSERT_TRUE(small.file) << small.error();
    EXPECT_EQ(small.count<Geometry>(), 2u) << "one for each material, however many meshes";

    GltfMaker large;
    const int positions = large.addFloats(std::vector<float>(3 * 6000, 0.5f), "VEC3");
    for (int i = 0; i < 2; ++i)
        large.addMeshNode(
            {{"attributes", {{"POSITION", positions}}}, {"material", large.add("materials", {{"name", "m"}})}});
    const Loaded loaded = load(large);
    ASSERT_TRUE(loaded.file) << loaded.error();
    const auto& first = loaded.only<Geometry>(0).positions.storage();
    const auto& second = loaded.only<Geometry>(1).positions.storage();
    EXPECT_TRUE(first.sharesChunk(0, second));
    EXPECT_NE(loaded.only<Geometry>(0).material.get().id, loaded.only<Geometry>(1).material.get().id);
}

}  // namespace
}  // namespace umbriel::test
