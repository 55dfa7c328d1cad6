// Index maps, hit distances, lifts of the camera.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "common/trace/ray_scene.h"
#include "common/visibility/chag.h"
#include "common/visibility/index_map.h"
#include "common/visibility/map_maker.h"
#include "tests/unit/visibility/reference.h"
#include "tests/unit/visibility/test_meshes.h"

namespace umbriel::visibility {
namespace {

using std::numbers::pi;

TEST(IndexMap, TexelsAreWhereTheirDirectionsAre) {
    const EnvironmentSize size{64, 32};
    EXPECT_EQ(environmentIndex(size, {0, 1, 0}) / 64, 0);
    EXPECT_EQ(environmentIndex(size, {0, -1, 0}) / 64, 31);
    EXPECT_EQ(environmentIndex(size, {1e-6f, 0, -1}), 16 * 64 + 32);
    EXPECT_EQ(environmentIndex(size, {1, 1e-6f, 0}), 15 * 64 + 48);
    // Every texel's centre comes back as that texel.
    for (std::uint32_t y = 0; y < 32; ++y) {
        for (std::uint32_t x = 0; x < 64; ++x) {
            const double down = pi * (y + 0.5) / 32, around = 2 * pi * (x + 0.5) / 64 - pi;
            const glm::vec3 d(std::sin(down) * std::sin(around), std::cos(down), -std::sin(down) * std::cos(around));
            EXPECT_EQ(environmentIndex(size, d), y * 64 + x);
        }
    }
    EXPECT_TRUE(indexable({1024, 63}));
    EXPECT_FALSE(indexable({1024, 64}));
    EXPECT_FALSE(indexable({0, 64}));
}

TEST(IndexMap, BlockedPixelsSeeNothing) {
    const auto mesh = prepare(test::plate(2));
    const Mapping m{MappingKind::HemiSphere, 8};
    const trace::DirectionPackets set = directionPackets(m);
    std::vector<std::uint8_t> mask(maskBytes(pixelCount(m)), 0x55);
    std::vector<std::uint16_t> indices(pixelCount(m));
    const trace::Origin o = origin(*mesh, 0, DirectionFrame::Vertex);
    indexMap(set, o, mask, {64, 32}, indices);
    for (std::uint32_t p = 0; p < pixelCount(m); ++p) {
        const glm::dvec3 d = direction(m, p);
        const glm::vec3 world = trace::worldDirection(o, float(d.x), float(d.y), float(d.z));
        EXPECT_EQ(indices[p], p % 2 == 0 ? environmentIndex({64, 32}, world) : kBlockedIndex);
    }
}

TEST(HitDistance, IsTheReferencesToRounding) {
    const auto mesh = prepare(test::cloth(80, 40));
    const test::Reference reference(*mesh);
    const trace::DirectionPackets set = directionPackets({MappingKind::HemiSphere, 16});
    for (const trace::Guard guard : {trace::Guard::Exact, trace::Guard::FastFan}) {
        const auto scene = trace::RayScene::create(mesh->view(), guard, 1);
        trace::RayScene::Tracer tracer(**scene);
        std::vector<float> distances(set.lanes());
        std::vector<std::uint8_t> blocked(set.packets());
        std::uint64_t wrong = 0, all = 0;
        for (std::uint32_t row = 0; row < mesh->rows.size(); row += 40) {
            const trace::Origin o = origin(*mesh, row, DirectionFrame::Vertex);
            const double endless = std::numeric_limits<double>::infinity();
            tracer.distances(o, mesh->ownTriangles(o.position), set, endless, distances);
            tracer.blocked(o, mesh->ownTriangles(o.position), set, endless, blocked);
            for (std::size_t lane = 0; lane < set.lanes(); ++lane) {
                ASSERT_EQ(std::isfinite(distances[lane]), (blocked[lane / 8] >> (lane % 8) & 1) != 0);
                if (distances[lane] == 0.0f) continue;  // the fan
                const glm::vec3 d = trace::worldDirection(o, set.x[lane], set.y[lane], set.z[lane]);
                const double truth = reference.distance(o, d);
                ++all;
                // Fast starts 1e-6 of the diagonal away, which moves hits of nearly parallel triangles much further.
                if (std::isfinite(truth) != std::isfinite(distances[lane]) ||
                    (std::isfinite(truth) &&
                     std::abs(distances[lane] - truth) > 1e-5 * mesh->diagonal + 1e-4 * truth)) {
                    ++wrong;
                }
            }
        }
        EXPECT_LE(wrong, guard == trace::Guard::Exact ? 0 : all / 100) << all;
    }
}

// A pyramid with its apex up has nothing above the tangent plane; a funnel has walls at a known angle.
TEST(CameraHeight, FollowsTheSteepestTriangle) {
    Mesh funnel;
    funnel.positions = {{0, 0, 0}, {1, 0, 1}, {0, 1, 1}, {-1, 0, 1}, {0, -1, 1}};
    funnel.indices = {0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1};
    const auto mesh = prepare(funnel);
    ASSERT_TRUE(mesh);
    const std::uint32_t row = mesh->vertexRow[0];
    EXPECT_NEAR(std::abs(mesh->rows[row].normal.z), 1.0, 1e-6);
    // Edges rise at 45 degrees from z, the middle of a triangle at atan(1/sqrt(2)): steeper.
    EXPECT_NEAR(steepestAngle(*mesh, row), std::atan(std::sqrt(0.5)), 1e-6);

    const double near = 0.01, epsilon = 1e-5;
    EXPECT_NEAR(cameraHeight(MappingKind::HemiCube, 0, pi / 4, near, epsilon), near * std::numbers::sqrt2, 1e-15);
    EXPECT_NEAR(cameraHeight(MappingKind::SinglePlane, pi / 2, pi / 4, near, epsilon), near * (std::numbers::sqrt2 - 1),
                1e-15);
    // eq. 26 would be 0, negative or infinite here.
    EXPECT_EQ(cameraHeight(MappingKind::HemiCube, 0, pi / 2, near, epsilon), epsilon);
    EXPECT_EQ(cameraHeight(MappingKind::HemiCube, 0, 2.0, near, epsilon), epsilon);
    EXPECT_EQ(cameraHeight(MappingKind::HemiCube, 0, 0.0, near, epsilon), epsilon);
    EXPECT_EQ(cameraHeight(MappingKind::SinglePlane, 1.0, 1.5, near, epsilon), epsilon);
    const auto flat = prepare(test::plate(4));
    EXPECT_NEAR(steepestAngle(*flat, 5), pi / 2, 1e-12);
}

// The half box |x|, |y|, z < near about the lifted eye holds no point of a wall that rises at alpha at any azimuth.
TEST(CameraHeight, LiftsTheNearPlanesOutOfTheFan) {
    const double near = 0.01;
    for (double alpha = 0.1; alpha < 1.5; alpha += 0.1) {
        const double lift = cameraHeight(MappingKind::HemiCube, 0, alpha, near, 1e-6);
        for (double azimuth = 0; azimuth < 2 * pi; azimuth += 0.05) {
            // Where the ray of the wall leaves the box sideways it must be below the box.
            const double reach = near / std::max(std::abs(std::cos(azimuth)), std::abs(std::sin(azimuth)));
            EXPECT_LE(reach / std::tan(alpha), lift * (1 + 1e-9));
        }
    }
}

}  // namespace
}  // namespace umbriel::visibility
