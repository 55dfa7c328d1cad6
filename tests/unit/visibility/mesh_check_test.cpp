#include "common/visibility/mesh_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/visibility/test_meshes.h"

namespace umbriel::visibility {
namespace {

void append(Mesh& to, const Mesh& from) {
    const auto first = static_cast<std::uint32_t>(to.positions.size());
    to.positions.insert(to.positions.end(), from.positions.begin(), from.positions.end());
    for (const std::uint32_t i : from.indices) to.indices.push_back(i + first);
}

Mesh scaled(Mesh mesh, float factor) {
    for (glm::vec3& p : mesh.positions) p *= factor;
    return mesh;
}

std::uint64_t count(const Mesh& mesh, const std::string& condition) {
    return checkMesh(mesh)->finding(condition).count;
}

TEST(MeshCheck, SoundMeshHasNothingToReport) {
    const auto report = checkMesh(test::sphere(3));
    ASSERT_TRUE(report);
    EXPECT_TRUE(report->closed);
    EXPECT_EQ(report->components, 1u);
    EXPECT_EQ(report->findings.size(), 11u);
    for (const MeshFinding& f : report->findings) EXPECT_EQ(f.count, 0u) << f.condition;
}

TEST(MeshCheck, OpenEdgesAreThoseOfTheRim) {
    EXPECT_EQ(count(test::plate(5), "open-edges"), 20u);
    EXPECT_EQ(count(test::cloth(40, 20), "open-edges"), 80u);
    EXPECT_FALSE(checkMesh(test::plate(5))->closed);
}

TEST(MeshCheck, DuplicatesOfABoxAreItsSeams) {
    // 6 faces of 16 vertices; 56 positions.
    const auto report = checkMesh(test::box(3, false));
    EXPECT_EQ(report->finding("duplicate-vertices").count, 96u - 56u);
    EXPECT_EQ(report->finding("duplicate-vertices").examples.size(), 5u);
    EXPECT_TRUE(report->closed);
    EXPECT_EQ(count(*weld(test::box(3, false), 0.0), "duplicate-vertices"), 0u);
}

TEST(MeshCheck, TwoSpheresThatMeetIntersect) {
    Mesh m = test::sphere(2);
    append(m, test::moved(test::sphere(2), {1.5, 0.013, 0.017}));
    const auto report = checkMesh(m);
    EXPECT_GT(report->finding("intersecting-faces").count, 5u);
    EXPECT_EQ(report->components, 2u);
    EXPECT_EQ(report->finding("inner-components").count, 0u);
    Mesh apart = test::sphere(2);
    append(apart, test::moved(test::sphere(2), {2.5, 0, 0}));
    EXPECT_EQ(count(apart, "intersecting-faces"), 0u);
}

// Against all pairs, without the grid.
TEST(MeshCheck, IntersectionsAreFoundWhereverTheyAre) {
    Mesh m = test::cloth(40, 20);
    Mesh wall = test::plate(7);
    for (glm::vec3& p : wall.positions) p = {p.x, 0.8f + 0.7f * p.y, 0.03f * p.x};
    append(m, wall);
    const auto whole = checkMesh(m);
    // The same mesh with its triangles in another order meets in as many pairs.
    Mesh shuffled = m;
    for (std::size_t t = 0, n = m.indices.size() / 3; t < n; ++t) {
        for (int k = 0; k < 3; ++k) shuffled.indices[3 * t + k] = m.indices[3 * (t * 331 % n) + k];
    }
    EXPECT_GT(whole->finding("intersecting-faces").count, 20u);
    EXPECT_EQ(count(shuffled, "intersecting-faces"), whole->finding("intersecting-faces").count);
}

TEST(MeshCheck, SphereInsideASphereIsInner) {
    Mesh m = test::sphere(2);
    append(m, scaled(test::sphere(2), 0.5f));
    EXPECT_EQ(count(m, "inner-components"), 1u);
    Mesh open = m;
    open.indices.erase(open.indices.begin(), open.indices.begin() + 3);  // a hole in the outer one
    EXPECT_EQ(count(open, "inner-components"), 0u);
}

TEST(MeshCheck, CrackIsTwoRimsSideBySide) {
    Mesh m = test::plate(4);
    Mesh right = test::moved(test::plate(4), {2.0 + 1e-5, 0, 0});
    append(m, right);
    const auto report = checkMesh(m);
    EXPECT_EQ(report->finding("cracks").count, 10u);  // five vertices on either side
    EXPECT_EQ(count(test::plate(4), "cracks"), 0u);
    const auto welded = weld(m, 1e-4);
    ASSERT_TRUE(welded);
    EXPECT_EQ(count(*welded, "cracks"), 0u);
    EXPECT_EQ(checkMesh(*welded)->components, 1u);
    EXPECT_EQ(welded->positions.size(), 45u);
}

TEST(MeshCheck, WindingUnusedDegenerateAndManyAtOneEdge) {
    Mesh m = test::plate(3);
    std::swap(m.indices[1], m.indices[2]);
    m.positions.push_back({9, 9, 9});
    m.indices.insert(m.indices.end(), {0, 1, 1, 0, 1, 16});
    const auto report = checkMesh(m);
    EXPECT_EQ(report->finding("inconsistent-winding").count, 2u);  // its third edge is open or shared by three
    EXPECT_EQ(inconsistentEdges(m), 2u);
    EXPECT_EQ(inconsistentEdges(test::plate(3)), 0u);
    EXPECT_EQ(report->finding("degenerate-faces").count, 1u);
    EXPECT_EQ(report->finding("unused-vertices").count, 0u);
    m.positions.push_back({7, 7, 7});
    EXPECT_EQ(count(m, "unused-vertices"), 1u);
    const std::string text = toText(*report);
    EXPECT_NE(text.find("triangle 18 of vertices 0, 1, 1"), std::string::npos) << text;
}

TEST(MeshCheck, NonFiniteCoordinatesAreCountedAndNothingElse) {
    Mesh m = test::plate(2);
    m.positions[4].z = std::nanf("");
    m.positions[5].x = INFINITY;
    const auto report = checkMesh(m);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->finding("non-finite-coordinates").count, 2u);
    EXPECT_EQ(report->finding("open-edges").count, 0u);
    EXPECT_FALSE(weld(m, 0.0));
    EXPECT_FALSE(orient(m));
    EXPECT_FALSE(checkMesh({}));
    EXPECT_FALSE(checkMesh({{{0, 0, 0}}, {0, 0, 1000000000}}));
}

TEST(Orient, ClosedMeshesEndOutwards) {
    for (const bool inwards : {false, true}) {
        Mesh m = test::box(3, inwards);
        std::swap(m.indices[4], m.indices[5]);
        std::swap(m.indices[31], m.indices[32]);
        const auto oriented = orient(m);
        ASSERT_TRUE(oriented);
        EXPECT_EQ(oriented->unorientable, 0u);
        EXPECT_EQ(oriented->flipped, inwards ? 106u : 2u);
        EXPECT_EQ(count(oriented->mesh, "inconsistent-winding"), 0u);
        const auto prepared = prepare(oriented->mesh);
        for (const Row& row : prepared->rows) EXPECT_GT(glm::dot(row.normal, prepared->positions[row.position]), 0.9f);
    }
}

TEST(Orient, OpenMeshesFollowTheMajority) {
    Mesh m = test::cloth(20, 10);
    for (std::size_t t = 0; t < 40; ++t) std::swap(m.indices[9 * t + 1], m.indices[9 * t + 2]);
    const auto oriented = orient(m);
    EXPECT_EQ(oriented->flipped, 40u);
    EXPECT_EQ(oriented->mesh.indices, test::cloth(20, 10).indices);
}

TEST(Orient, MoebiusStripStaysInconsistentSomewhere) {
    Mesh m;
    const std::uint32_t n = 24;
    for (std::uint32_t i = 0; i < n; ++i) {
        const double a = 2 * std::numbers::pi * i / n;
        for (const double side : {-0.3, 0.3}) {
            const double r = 1 + side * std::cos(a / 2);
            m.positions.emplace_back(r * std::cos(a), r * std::sin(a), side * std::sin(a / 2));
        }
    }
    for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t a = 2 * i, b = 2 * i + 1;
        const std::uint32_t c = i + 1 < n ? a + 2 : 1, d = i + 1 < n ? a + 3 : 0;
        m.indices.insert(m.indices.end(), {a, b, c, b, d, c});
    }
    EXPECT_EQ(orient(m)->unorientable, 1u);
}

}  // namespace
}  // namespace umbriel::visibility
