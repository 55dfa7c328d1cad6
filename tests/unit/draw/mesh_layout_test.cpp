#include "server/draw/mesh_layout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "server/draw/text_font.h"

namespace umbriel {
namespace {

struct Grid {
    std::vector<glm::vec3> positions;
    std::vector<glm::vec2> texCoords;
    std::vector<std::uint32_t> indices;
};

Grid makeGrid(std::uint32_t cells) {
    Grid grid;
    for (std::uint32_t y = 0; y <= cells; ++y)
        for (std::uint32_t x = 0; x <= cells; ++x) {
            grid.positions.push_back({float(x), float(y), 0.0f});
            grid.texCoords.push_back({float(x), float(y)});
        }
    for (std::uint32_t y = 0; y < cells; ++y)
        for (std::uint32_t x = 0; x < cells; ++x) {
            const std::uint32_t a = y * (cells + 1) + x;
            for (const std::uint32_t i : {a, a + 1, a + cells + 2, a, a + cells + 2, a + cells + 1})
                grid.indices.push_back(i);
        }
    return grid;
}

TEST(MeshLayout, SortingKeepsEveryTriangleAndItsNumber) {
    const Grid grid = makeGrid(32);
    const TriangleOrder order = orderTriangles(grid.indices, grid.positions, true);
    ASSERT_EQ(order.indices.size(), grid.indices.size());
    ASSERT_EQ(order.primitives.size(), grid.indices.size() / 3);
    std::set<std::uint32_t> seen;
    for (std::size_t i = 0; i < order.primitives.size(); ++i) {
        EXPECT_TRUE(seen.insert(order.primitives[i]).second);
        for (std::size_t k = 0; k < 3; ++k)
            ASSERT_EQ(order.indices[3 * i + k], grid.indices[3 * order.primitives[i] + k]);
    }
    const TriangleOrder again = orderTriangles(grid.indices, grid.positions, true);
    EXPECT_EQ(order.indices, again.indices);
}

TEST(MeshLayout, SortedClustersAreSmall) {
    const Grid grid = makeGrid(64);
    const TriangleOrder order = orderTriangles(grid.indices, grid.positions, true);
    const std::vector<Cluster> clusters = clustersOf(order.indices, grid.positions);
    double sum = 0.0;
    std::size_t triangles = 0;
    for (const Cluster& cluster : clusters) {
        const glm::vec3 size = cluster.box.maximum - cluster.box.minimum;
        sum += double(size.x) * double(size.y);
        triangles += cluster.triangles;
    }
    EXPECT_EQ(triangles, grid.indices.size() / 3);
    EXPECT_LT(sum, 2.5 * 64 * 64);  // boxes overlap little: unsorted rows would do too, a random order 1000 times worse
}

TEST(MeshLayout, SmallAndForbiddenMeshesKeepTheirOrder) {
    const Grid small = makeGrid(4);
    EXPECT_TRUE(orderTriangles(small.indices, small.positions, true).primitives.empty());
    const Grid large = makeGrid(32);
    EXPECT_TRUE(orderTriangles(large.indices, large.positions, false).primitives.empty());
}

TEST(MeshLayout, TrianglesWithWrongIndicesBecomePoints) {
    const std::vector<glm::vec3> positions(3);
    const std::vector<std::uint32_t> indices{0, 1, 2, 0, 1, 3, 4000000000u, 1, 2, 1};
    const TriangleOrder order = orderTriangles(indices, positions, true);
    EXPECT_EQ(order.indices, (std::vector<std::uint32_t>{0, 1, 2, 0, 0, 0, 0, 0, 0}));
}

TEST(MeshLayout, FaceNormalsAreUnitAtEveryScale) {
    for (const float scale : {1e-30f, 1e-6f, 1.0f, 1e15f, 1e30f}) {
        const glm::vec3 normal = faceNormal({0, 0, 0}, {scale, 0, 0}, {0, scale, 0});
        EXPECT_EQ(normal, glm::vec3(0, 0, 1)) << scale;
    }
    EXPECT_EQ(faceNormal({1, 1, 1}, {1, 1, 1}, {2, 2, 2}), glm::vec3(0, 0, 1));
}

TEST(MeshLayout, DerivedTangentsPointWhereUGrows) {
    Grid grid = makeGrid(2);
    for (const bool mirrored : {false, true}) {
        for (std::size_t i = 0; i < grid.texCoords.size(); ++i)
            grid.texCoords[i].x = mirrored ? -grid.positions[i].x : grid.positions[i].x;
        const auto tangents = deriveTangents(grid.indices, grid.positions, {}, grid.texCoords);
        for (const glm::vec4& tangent : tangents)
            EXPECT_EQ(tangent, glm::vec4(mirrored ? -1 : 1, 0, 0, mirrored ? -1 : 1));
    }
    // No texture direction at all: still unit and perpendicular.
    std::fill(grid.texCoords.begin(), grid.texCoords.end(), glm::vec2(0.5f));
    for (const glm::vec4& tangent : deriveTangents(grid.indices, grid.positions, {}, grid.texCoords)) {
        EXPECT_NEAR(glm::length(glm::vec3(tangent)), 1.0f, 1e-6f);
        EXPECT_EQ(tangent.z, 0.0f);
    }
}

TEST(MeshLayout, SanitisingRemovesWhatIsNotFinite) {
    float values[] = {1.0f, std::numeric_limits<float>::infinity(), -2.0f, std::numeric_limits<float>::quiet_NaN()};
    sanitise(values);
    EXPECT_EQ(values[0], 1.0f);
    EXPECT_EQ(values[1], 0.0f);
    EXPECT_EQ(values[2], -2.0f);
    EXPECT_EQ(values[3], 0.0f);
}

TEST(TextFont, EveryPrintableCharacterLooksDifferentAndFitsItsCell) {
    std::set<std::vector<std::uint8_t>> glyphs;
    for (char c = ' '; c <= '~'; ++c) {
        const TextBitmap bitmap = drawText(std::string_view(&c, 1));
        ASSERT_EQ(bitmap.width, kTextCellWidth);
        ASSERT_EQ(bitmap.height, kTextCellHeight);
        for (int y = 0; y < kTextCellHeight; ++y) EXPECT_EQ(bitmap.coverage[static_cast<std::size_t>(y * 6 + 5)], 0);
        EXPECT_TRUE(glyphs.insert(bitmap.coverage).second) << c;
    }
    EXPECT_EQ(drawText("\x01").coverage, drawText("?").coverage);
}

TEST(TextFont, OnlyWhatHangsBelowTheLineIsBelowIt) {
    for (char c = ' '; c <= '~'; ++c) {
        const TextBitmap bitmap = drawText(std::string_view(&c, 1));
        const auto lastRow = bitmap.coverage.end() - kTextCellWidth;
        const bool hangs = std::any_of(lastRow, bitmap.coverage.end(), [](std::uint8_t value) { return value != 0; });
        EXPECT_EQ(hangs, std::string_view("gjpqy,;_").find(c) != std::string_view::npos) << c;
    }
}

}  // namespace
}  // namespace umbriel
