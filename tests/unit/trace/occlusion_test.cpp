#include "common/trace/occlusion.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cmath>

namespace umbriel::trace {
namespace {

using Ray = OcclusionScene::Ray;

struct Triangles {
    std::vector<glm::dvec3> positions;
    std::vector<glm::uvec3> corners;
    void quad(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
        const auto first = static_cast<std::uint32_t>(positions.size());
        positions.insert(positions.end(), {a, b, c, d});
        corners.push_back({first, first + 1, first + 2});
        corners.push_back({first, first + 2, first + 3});
    }
    std::unique_ptr<OcclusionScene> build() const {
        auto scene = OcclusionScene::create(positions, corners);
        EXPECT_TRUE(scene);
        return std::move(*scene);
    }
};

// A floor of n x n cells in y = 0, and a square of side 1 above it at height 1.
Triangles floorAndSquare(int n, double size, const glm::dvec3& offset, double scale) {
    Triangles all;
    const double cell = size / n;
    for (int row = 0; row < n; ++row)
        for (int column = 0; column < n; ++column) {
            const double x = -0.5 * size + cell * column, z = -0.5 * size + cell * row;
            all.quad({x, 0, z}, {x + cell, 0, z}, {x + cell, 0, z + cell}, {x, 0, z + cell});
        }
    all.quad({-0.5, 1, -0.5}, {0.5, 1, -0.5}, {0.5, 1, 0.5}, {-0.5, 1, 0.5});
    for (glm::dvec3& p : all.positions) p = p * scale + offset;
    return all;
}

TEST(Occlusion, ASquaresShadowEndsWhereGeometrySays) {
    const auto scene = floorAndSquare(8, 10.0, {}, 1.0).build();
    // Light from 45 degrees: the shadow of [-0.5, 0.5] in x lies at [0.5, 1.5].
    const Ray toLight{glm::dvec3(-1, 1, 0)};
    for (const double e : {1e-6, 1e-9, 1e-12}) {
        EXPECT_FALSE(scene->blocked({0.5 - std::max(e, 1e-6), 0, 0.1}, 0, toLight)) << e;
        EXPECT_TRUE(scene->blocked({0.5 + std::max(e, 1e-6), 0, 0.1}, 0, toLight)) << e;
        EXPECT_TRUE(scene->blocked({1.5 - std::max(e, 1e-6), 0, 0.1}, 0, toLight)) << e;
        EXPECT_FALSE(scene->blocked({1.5 + std::max(e, 1e-6), 0, 0.1}, 0, toLight)) << e;
    }
}

TEST(Occlusion, RaysEndAtTheLight) {
    const auto scene = floorAndSquare(1, 10.0, {}, 1.0).build();
    EXPECT_TRUE(scene->blocked({0, 0, 0}, 0, {glm::dvec3(0, 2, 0), 1.0}));
    EXPECT_TRUE(scene->blocked({0, 0, 0}, 0, {glm::dvec3(0, 1.000001, 0), 1.0}));
    EXPECT_FALSE(scene->blocked({0, 0, 0}, 0, {glm::dvec3(0, 0.999999, 0), 1.0}));
    EXPECT_FALSE(scene->blocked({0, 0, 0}, 0, {glm::dvec3(0, 0, 0), 1.0}));
}

// Points on a floor that is cut into coplanar cells, anywhere, at every scale and offset of the specification: no cell
// shadows its neighbour.
// A lamp in a face, on the edge of its two triangles: nobody is before it who sees it from either side.
RC_GTEST_PROP(Occlusion, AFaceInWhichTheLampLiesIsNotBeforeIt, ()) {
    Triangles all = floorAndSquare(1, 60.0, {}, 1.0);
    all.quad({-7, 5.3, -11}, {7, 5.3, -11}, {7, 5.3, 11}, {-7, 5.3, 11});
    const auto scene = all.build();
    const glm::dvec3 from(*rc::gen::inRange(-3000, 3000) * 1e-2, 0.0, *rc::gen::inRange(-3000, 3000) * 1e-2);
    const double along = *rc::gen::inRange(-100, 100) * 0.01;
    const glm::dvec3 lamp(7.0 * along, 5.3, 11.0 * along);
    // The small square at height 1 is before some of them.
    const glm::dvec3 atSquare = from + (lamp - from) / 5.3;
    RC_PRE(std::max(std::abs(atSquare.x), std::abs(atSquare.z)) > 0.501);
    RC_ASSERT(!scene->blocked(from, 0, {lamp - from, 1.0}));
    RC_ASSERT(!scene->blocked({from.x, 9.0, from.z}, 0, {lamp - glm::dvec3(from.x, 9.0, from.z), 1.0}));
}

RC_GTEST_PROP(Occlusion, CoplanarNeighboursDoNotShadowEachOther, ()) {
    const double scale = std::exp2(*rc::gen::inRange(-20, 21));
    const double offset = *rc::gen::element(0.0, 1e3, 1e6);
    const Triangles triangles =
        floorAndSquare(16, 10.0, glm::dvec3(offset, -offset, offset) * std::max(1.0, scale), scale);
    const auto scene = triangles.build();
    for (int i = 0; i < 64; ++i) {
        const auto triangle = static_cast<std::uint32_t>(*rc::gen::inRange(0, 16 * 16 * 2));
        const glm::uvec3 t = triangles.corners[triangle];
        const double u = *rc::gen::inRange(0, 1001) / 1000.0, v = *rc::gen::inRange(0, 1001) / 1000.0 * (1.0 - u);
        const glm::dvec3 point =
            triangles.positions[t.x] * (1.0 - u - v) + triangles.positions[t.y] * u + triangles.positions[t.z] * v;
        // Away from the square above: sideways at 0.1 and more over the floor.
        const double angle = *rc::gen::inRange(0, 360) * 0.0174532925;
        const glm::dvec3 local = (point - glm::dvec3(offset, -offset, offset) * std::max(1.0, scale)) / scale;
        const glm::dvec3 direction(std::cos(angle), *rc::gen::inRange(10, 100) / 100.0, std::sin(angle));
        const glm::dvec2 above(local.x + direction.x / direction.y, local.z + direction.z / direction.y);
        if (std::max(std::abs(above.x), std::abs(above.y)) < 0.501) continue;
        RC_ASSERT(!scene->blocked(scene->onPlaneOf(triangle, point), triangle, {direction}));
    }
}

// In a corner the other wall blocks, however near the point is to it.
TEST(Occlusion, AWallShadowsTheFloorRightBesideIt) {
    Triangles corner;
    corner.quad({0, 0, 0}, {5, 0, 0}, {5, 0, 5}, {0, 0, 5});
    corner.quad({0, 0, 0}, {0, 0, 5}, {0, 5, 5}, {0, 5, 0});
    const auto scene = corner.build();
    for (const double distance : {1.0, 1e-3, 1e-6, 1e-9})
        EXPECT_TRUE(scene->blocked({distance, 0, 2}, 1, {glm::dvec3(-1, 0.3, 0)})) << distance;
}

TEST(Occlusion, HolesLetRaysThrough) {
    Triangles one;
    one.positions = {{0, 1, 0}, {1, 1, 0}, {0, 1, 1}};
    one.corners = {{0, 1, 2}};
    const auto scene = OcclusionScene::create(one.positions, one.corners, {1},
                                              [](std::uint32_t, double u, double v) { return u + v < 0.5; });
    ASSERT_TRUE(scene);
    const Ray up{glm::dvec3(0, 1, 0)};
    EXPECT_TRUE((*scene)->blocked({0.2, 0, 0.2}, OcclusionScene::kNoTriangle, up));
    EXPECT_FALSE((*scene)->blocked({0.3, 0, 0.3}, OcclusionScene::kNoTriangle, up));
    EXPECT_FALSE((*scene)->blocked({0.6, 0, 0.6}, OcclusionScene::kNoTriangle, up));
}

TEST(Occlusion, ManyRaysAreTheSameRays) {
    const auto scene = floorAndSquare(4, 10.0, {}, 1.0).build();
    std::vector<Ray> rays;
    for (int i = 0; i < 37; ++i) rays.push_back({glm::dvec3(std::cos(0.7 * i), 0.2 + 0.05 * i, std::sin(0.7 * i))});
    std::vector<std::uint8_t> together(rays.size());
    const glm::dvec3 origin(0.3, 0, 0.2);
    scene->blocked(origin, 0, rays, together);
    for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(together[i] != 0, scene->blocked(origin, 0, rays[i])) << i;
}

TEST(Occlusion, NothingBlocksNothing) {
    const auto scene = OcclusionScene::create({}, {});
    ASSERT_TRUE(scene);
    EXPECT_FALSE((*scene)->blocked({0, 0, 0}, 0, {glm::dvec3(0, 1, 0)}));
}

}  // namespace
}  // namespace umbriel::trace
