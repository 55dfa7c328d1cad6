#include "client/bake/light_map_charts.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "tests/unit/atlas/light_map_meshes.h"

namespace umbriel {
namespace {

double areaOf(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
    return 0.5 * std::abs((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x));
}

double areaOf(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    return 0.5 * glm::length(glm::cross(b - a, c - a));
}

// Each triangle with an area in one chart, at most so much smaller than it is.
void expectComplete(const ChartMesh& mesh, const std::vector<Chart>& charts) {
    std::multiset<std::uint32_t> seen;
    for (const Chart& chart : charts) {
        ASSERT_EQ(chart.corners.size(), 3 * chart.triangles.size());
        for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
            seen.insert(chart.triangles[i]);
            const glm::uvec3 t = mesh.triangles[chart.triangles[i]];
            const double area = areaOf(mesh.positions[t.x], mesh.positions[t.y], mesh.positions[t.z]);
            const double flat = areaOf(chart.corners[3 * i], chart.corners[3 * i + 1], chart.corners[3 * i + 2]);
            EXPECT_LE(flat, area * (1.0 + 1e-9));
            EXPECT_GE(flat, area * kChartCosine * (1.0 - 1e-9));
        }
        for (const glm::dvec2& corner : chart.corners)
            for (int k = 0; k < 2; ++k) {
                EXPECT_GE(corner[k], 0.0);
                EXPECT_LE(corner[k], chart.extent[k]);
            }
    }
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) EXPECT_EQ(seen.count(i), 1u) << i;
}

// How many of a grid of points over the chart lie inside more than one triangle.
std::size_t pointsCoveredTwice(const Chart& chart, int side = 150) {
    std::size_t twice = 0;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            const glm::dvec2 p = chart.extent * glm::dvec2((x + 0.473) / side, (y + 0.519) / side);
            int inside = 0;
            for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
                const glm::dvec2* c = &chart.corners[3 * i];
                const double whole = areaOf(c[0], c[1], c[2]);
                const double parts = areaOf(p, c[0], c[1]) + areaOf(p, c[1], c[2]) + areaOf(p, c[2], c[0]);
                inside += parts <= whole * (1.0 + 1e-12) ? 1 : 0;
            }
            twice += inside > 1 ? 1 : 0;
        }
    return twice;
}

TEST(Charts, ACubeHasOneForEachFaceWithItsSidesAlongTheTexels) {
    const ChartMesh cube = cubeMesh(2.0);
    const std::vector<Chart> charts = chartsOf(cube);
    ASSERT_EQ(charts.size(), 6u);
    expectComplete(cube, charts);
    for (const Chart& chart : charts) {
        EXPECT_EQ(chart.triangles.size(), 2u);
        EXPECT_NEAR(chart.extent.x, 2.0, 1e-12);
        EXPECT_NEAR(chart.extent.y, 2.0, 1e-12);
        ASSERT_TRUE(chart.projection);
        // The corners are where the projection takes the vertices.
        for (std::size_t i = 0; i < chart.triangles.size(); ++i)
            for (int k = 0; k < 3; ++k) {
                const glm::dvec3 p = cube.positions[cube.triangles[chart.triangles[i]][k]];
                const glm::dvec2 at(glm::dot(chart.projection->u, p), glm::dot(chart.projection->v, p));
                EXPECT_LT(
                    glm::length(at - chart.projection->origin - chart.corners[3 * i + static_cast<std::size_t>(k)]),
                    1e-12);
            }
    }
}

TEST(Charts, ASphereHasFewAndNoneLiesOverItself) {
    const ChartMesh sphere = sphereMesh(1.0, 24, 12);
    const std::vector<Chart> charts = chartsOf(sphere);
    expectComplete(sphere, charts);
    EXPECT_LE(charts.size(), sphere.triangles.size() / 10);
    for (const Chart& chart : charts) EXPECT_EQ(pointsCoveredTwice(chart), 0u);
}

// Every step of the ramp turns by little, yet its second turn lies above the first one.
TEST(Charts, ASpiralRampIsCutBeforeItLiesOverItself) {
    ChartMesh ramp;
    constexpr int kSteps = 48;  // a turn
    for (int i = 0; i <= 2 * kSteps; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / kSteps;
        for (const double radius : {1.0, 2.0})
            ramp.positions.push_back({radius * std::cos(angle), 0.02 * i, radius * std::sin(angle)});
    }
    for (std::uint32_t i = 0; i < 2 * kSteps; ++i) {
        ramp.triangles.push_back({2 * i, 2 * i + 2, 2 * i + 1});
        ramp.triangles.push_back({2 * i + 1, 2 * i + 2, 2 * i + 3});
    }
    const std::vector<Chart> charts = chartsOf(ramp);
    expectComplete(ramp, charts);
    EXPECT_GE(charts.size(), 2u);
    for (const Chart& chart : charts) EXPECT_EQ(pointsCoveredTwice(chart), 0u);
}

TEST(Charts, TrianglesWithoutAnAreaOrWithBrokenIndicesHaveNone) {
    ChartMesh mesh = cubeMesh(1.0);
    mesh.triangles.push_back({0, 0, 1});
    mesh.triangles.push_back({0, 1, 100000});
    std::size_t placed = 0;
    for (const Chart& chart : chartsOf(mesh)) placed += chart.triangles.size();
    EXPECT_EQ(placed, 12u);
    EXPECT_TRUE(chartsOf({}).empty());
}

TEST(Charts, UniqueTextureCoordinatesAreTakenAndOthersAreNot) {
    // Two squares beside each other; as texture coordinates their own places, halved.
    ChartMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {3, 0, 0}, {4, 0, 0}, {4, 1, 0}, {3, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
    mesh.texCoords = {{0, 0}, {0.4, 0}, {0.4, 0.2}, {0, 0.2}, {0.5, 0}, {0.9, 0}, {0.9, 0.4}, {0.5, 0.4}};
    ASSERT_TRUE(areUnique(mesh));
    const std::vector<Chart> charts = chartsOf(mesh);
    ASSERT_EQ(charts.size(), 2u);
    EXPECT_FALSE(charts[0].projection);
    // As large as the surface, in the proportions of the coordinates.
    EXPECT_NEAR(charts[0].extent.x * charts[0].extent.y, 1.0, 1e-12);
    EXPECT_NEAR(charts[0].extent.x / charts[0].extent.y, 2.0, 1e-12);

    ChartMesh shared = mesh;  // both squares at one place
    for (int i = 0; i < 4; ++i)
        shared.texCoords[static_cast<std::size_t>(4 + i)] = shared.texCoords[static_cast<std::size_t>(i)];
    ChartMesh outside = mesh;
    outside.texCoords[6] = {1.1, 0.4};
    ChartMesh flat = mesh;
    for (glm::dvec2& t : flat.texCoords) t.y = 0.0;
    ChartMesh missing = mesh;
    missing.texCoords.pop_back();
    ChartMesh broken = mesh;
    broken.texCoords[0].x = NAN;
    for (const ChartMesh& other : {shared, outside, flat, missing, broken}) EXPECT_FALSE(areUnique(other));
    EXPECT_TRUE(chartsOf(shared)[0].projection);
}

TEST(Charts, MirroredIslandsAreUniqueToo) {
    ChartMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.texCoords = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};  // clockwise
    EXPECT_TRUE(areUnique(mesh));
    expectComplete(mesh, chartsOf(mesh));
}

RC_GTEST_PROP(ChartLayout, NoTwoChartsShareATexelAndNoneLeavesTheAtlas, ()) {
    const auto count = *rc::gen::inRange(1, 200);
    const auto size = static_cast<std::uint32_t>(*rc::gen::inRange(16, 300));
    std::vector<glm::dvec2> extents;
    for (int i = 0; i < count; ++i)
        extents.emplace_back(*rc::gen::inRange(0, 1000) / 37.0, *rc::gen::inRange(0, 1000) / 91.0);
    const auto spots = layOut(extents, size);
    RC_ASSERT(static_cast<bool>(spots));
    std::vector<int> owner(std::size_t{size} * size, -1);
    for (int i = 0; i < count; ++i) {
        const ChartSpot& spot = (*spots)[static_cast<std::size_t>(i)];
        RC_ASSERT(spot.width >= 1 && spot.height >= 1 && spot.x + spot.width <= size && spot.y + spot.height <= size);
        for (std::uint32_t y = spot.y; y < spot.y + spot.height; ++y)
            for (std::uint32_t x = spot.x; x < spot.x + spot.width; ++x) {
                RC_ASSERT(owner[std::size_t{y} * size + x] == -1);
                owner[std::size_t{y} * size + x] = i;
            }
        for (int k = 0; k < 2; ++k) {
            const double end = spot.at[k] + spot.scale[k] * extents[static_cast<std::size_t>(i)][k];
            RC_ASSERT(end <= (k == 0 ? spot.x + spot.width : spot.y + spot.height) + 1e-9);
        }
    }
}

TEST(ChartLayout, OneSquareFillsTheAtlasAndTooManyChartsAreRefused) {
    const auto one = layOut({{3.0, 3.0}}, 64);
    ASSERT_TRUE(one);
    EXPECT_EQ((*one)[0].width, 64u);
    EXPECT_EQ((*one)[0].height, 64u);
    EXPECT_DOUBLE_EQ((*one)[0].scale.x, 64.0 / 3.0);
    EXPECT_TRUE(layOut(std::vector<glm::dvec2>(16, {1.0, 1.0}), 4));
    const auto refused = layOut(std::vector<glm::dvec2>(17, {1.0, 1.0}), 4);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, Error::Kind::BadInput);
    EXPECT_NE(refused.error().message.find("17 charts"), std::string::npos) << refused.error().message;
    EXPECT_TRUE(layOut({}, 4)->empty());
}

}  // namespace
}  // namespace umbriel
