#include "server/draw/solid_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "server/draw/mesh_layout.h"

namespace umbriel {
namespace {

struct Mesh {
    std::vector<glm::vec3> positions;
    std::vector<std::uint32_t> indices;

    // Triangles share no vertex: places alone connect them.
    void addQuad(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d) {
        for (const glm::vec3& corner : {a, b, c, a, c, d}) {
            indices.push_back(static_cast<std::uint32_t>(positions.size()));
            positions.push_back(corner);
        }
    }
    void addBox(const glm::vec3& lower, const glm::vec3& size) {
        const auto at = [&](int x, int y, int z) { return lower + glm::vec3(x, y, z) * size; };
        addQuad(at(0, 0, 0), at(0, 1, 0), at(1, 1, 0), at(1, 0, 0));
        addQuad(at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1));
        addQuad(at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1));
        addQuad(at(0, 1, 0), at(0, 1, 1), at(1, 1, 1), at(1, 1, 0));
        addQuad(at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0));
        addQuad(at(1, 0, 0), at(1, 1, 0), at(1, 1, 1), at(1, 0, 1));
    }
    // By rings around z; at the poles every second triangle has no area.
    void addSphere(const glm::vec3& centre, float radius, int rings, int sectors) {
        const auto at = [&](int ring, int sector) {
            const float polar = 3.14159265f * static_cast<float>(ring) / static_cast<float>(rings);
            const float around = 6.2831853f * static_cast<float>(sector % sectors) / static_cast<float>(sectors);
            if (ring == 0 || ring == rings) return centre + glm::vec3(0.0f, 0.0f, ring == 0 ? radius : -radius);
            return centre + radius * glm::vec3(std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
                                               std::cos(polar));
        };
        for (int ring = 0; ring < rings; ++ring)
            for (int sector = 0; sector < sectors; ++sector)
                addQuad(at(ring, sector), at(ring + 1, sector), at(ring + 1, sector + 1), at(ring, sector + 1));
    }
    void turnRound(std::size_t firstTriangle = 0) {
        for (std::size_t i = 3 * firstTriangle; i < indices.size(); i += 3) std::swap(indices[i], indices[i + 1]);
    }
    SolidParts solids() const { return solidPartsOf(indices, positions); }
};

std::size_t solidTriangles(const SolidParts& parts) {
    return parts.partOfTriangle.size() -
           static_cast<std::size_t>(
               std::count(parts.partOfTriangle.begin(), parts.partOfTriangle.end(), SolidParts::kNone));
}

TEST(SolidParts, BoxesAndSpheresAreSolid) {
    Mesh mesh;
    mesh.addBox({-1, -2, -3}, {2, 3, 4});
    mesh.addSphere({10, 0, 0}, 1.5f, 8, 12);
    const SolidParts parts = mesh.solids();
    ASSERT_EQ(parts.boxes.size(), 2u);
    EXPECT_EQ(solidTriangles(parts), mesh.indices.size() / 3);
    EXPECT_EQ(parts.boxes[0].minimum, glm::vec3(-1, -2, -3));
    EXPECT_EQ(parts.boxes[0].maximum, glm::vec3(1, 1, 1));
    EXPECT_EQ(parts.boxes[1].maximum.z, 1.5f);
}

TEST(SolidParts, FarFromTheOriginRoundingIsNoDent) {
    Mesh mesh;
    mesh.addSphere({5000.0f, -3000.0f, 77.0f}, 1.0f, 6, 9);
    EXPECT_EQ(mesh.solids().boxes.size(), 1u);
}

TEST(SolidParts, FilesWithFewDigitsAreNoDents) {
    Mesh mesh;
    mesh.addSphere({52.3f, 17.9f, 1.1f}, 0.8f, 8, 14);
    for (glm::vec3& place : mesh.positions) place = glm::round(place * 1e4f) / 1e4f;
    EXPECT_EQ(mesh.solids().boxes.size(), 1u);
}

TEST(SolidParts, OpenMeshesAreNot) {
    Mesh mesh;
    mesh.addBox({0, 0, 0}, {1, 1, 1});
    mesh.indices.resize(mesh.indices.size() - 3);
    EXPECT_TRUE(mesh.solids().boxes.empty());
}

TEST(SolidParts, MeshesThatAreInsideOutAreNot) {
    Mesh mesh;
    mesh.addBox({0, 0, 0}, {1, 1, 1});
    mesh.turnRound();
    EXPECT_TRUE(mesh.solids().boxes.empty());
}

TEST(SolidParts, OneTriangleTurnedRoundIsEnough) {
    Mesh mesh;
    mesh.addBox({0, 0, 0}, {1, 1, 1});
    mesh.turnRound(11);
    EXPECT_TRUE(mesh.solids().boxes.empty());
}

TEST(SolidParts, DentedMeshesAreNot) {
    Mesh mesh;
    mesh.addBox({0, 0, 0}, {1, 1, 1});
    for (glm::vec3& place : mesh.positions)
        if (place == glm::vec3(1.0f)) place = glm::vec3(0.3f);  // behind the plane of its three neighbours
    EXPECT_TRUE(mesh.solids().boxes.empty());
}

// Each place of the outline would be covered twice, and by either winding.
TEST(SolidParts, TwiceTheSameBoxIsNot) {
    Mesh mesh;
    mesh.addBox({0, 0, 0}, {1, 1, 1});
    mesh.addBox({0, 0, 0}, {1, 1, 1});
    EXPECT_TRUE(mesh.solids().boxes.empty());
}

TEST(SolidParts, NeighboursDoNotSpoilOneAnother) {
    Mesh mesh;
    mesh.addBox({0, 0, 0}, {1, 1, 1});
    mesh.addQuad({-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0});
    mesh.addBox({1, 1, 1}, {1, 1, 1});  // touches the first at a corner
    const SolidParts parts = mesh.solids();
    EXPECT_EQ(parts.boxes.size(), 2u);
    EXPECT_EQ(solidTriangles(parts), 24u);
}

TEST(SolidParts, ClustersComeFirstAndHoldTheirPartsBoxes) {
    Mesh mesh;
    for (int i = 0; i < 60; ++i) {
        mesh.addBox({float(3 * i), 0, 0}, {1, 1, 1});
        mesh.addQuad({float(3 * i), 0, -1}, {float(3 * i + 3), 0, -1}, {float(3 * i + 3), 3, -1},
                     {float(3 * i), 3, -1});
    }
    TriangleOrder order = orderTriangles(mesh.indices, mesh.positions, true);
    SolidParts parts = solidPartsOf(order.indices, mesh.positions);
    moveSolidsFirst(order, parts);
    std::vector<std::uint32_t> numbers = order.primitives;
    std::sort(numbers.begin(), numbers.end());
    for (std::uint32_t i = 0; i < numbers.size(); ++i) ASSERT_EQ(numbers[i], i);
    for (std::size_t i = 0; i < order.primitives.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k)
            ASSERT_EQ(order.indices[3 * i + k], mesh.indices[3 * order.primitives[i] + k]);
        ASSERT_EQ(parts.partOfTriangle[i] != SolidParts::kNone, i < 720);
    }
    std::vector<Cluster> clusters = clustersOf(order.indices, mesh.positions);
    markSolids(clusters, parts, order.indices, mesh.positions);
    for (const Cluster& cluster : clusters) {
        ASSERT_EQ(cluster.solids.empty(), cluster.firstTriangle >= 720);
        if (cluster.solids.empty()) continue;
        // Whole boxes, also where some of their triangles are in another cluster.
        EXPECT_EQ(cluster.solids.minimum.y, 0.0f);
        EXPECT_EQ(cluster.solids.maximum.y, 1.0f);
        EXPECT_EQ(cluster.solids.maximum.z, 1.0f);
        EXPECT_TRUE(glm::all(glm::lessThanEqual(cluster.solids.minimum, cluster.box.minimum)));
        EXPECT_TRUE(glm::all(glm::greaterThanEqual(cluster.solids.maximum, cluster.box.maximum)));
    }
}

}  // namespace
}  // namespace umbriel
