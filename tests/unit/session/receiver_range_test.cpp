#include "client/session/receiver_range.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "client/session/shadow_fit.h"
#include "tests/unit/session/scene_fixture.h"
#include "tests/unit/session/test_views.h"

namespace umbriel {
namespace {

using test::isSeen;
using test::viewFrom;

double depthOf(const View& view, const glm::dvec3& world) {
    return -(view.viewFromWorld * (world - view.eyeWorld)).z;
}

bool isOnMap(const ShadowFit& fit, const glm::dvec3& world) {
    const glm::dvec4 clip = fit.clipFromWorld * glm::dvec4(world, 1.0);
    const double inner = 1.0 - 2.0 / fit.mapSize + 1e-6;
    return clip.w > 0.0 && std::abs(clip.x) <= inner * clip.w && std::abs(clip.y) <= inner * clip.w && clip.z >= 0.0 &&
           clip.z <= clip.w * (1.0 + 1e-9);
}

TEST(ReceiverRange, IsThatOfTheBoxesWithinTheFrustum) {
    const View view = viewFrom({0, 0, 10}, {0, 0, 0});
    const std::vector<Box3d> parts = {{{-1, -1, -1}, {1, 1, 1}},
                                      {{-1, -1, 30}, {1, 1, 31}},      // behind
                                      {{-1, 500, -1}, {1, 501, 1}},    // above
                                      {{-1, -0.1, -50}, {1, 0, -40}},  // far away
                                      {}};
    const auto ranges = receiverRanges(parts, {&view, 1});
    ASSERT_EQ(ranges.size(), 1u);
    EXPECT_NEAR(ranges[0].nearest, 9.0, 1e-12);
    EXPECT_NEAR(ranges[0].farthest, 60.0, 1e-12);
    EXPECT_EQ(ranges[0].boundsWorld.lower, glm::dvec3(-1, -1, -50));
    EXPECT_EQ(ranges[0].boundsWorld.upper, glm::dvec3(1, 1, 1));
    // A floor is cut to what the frustum leaves of it.
    const Box3d floor{{-100, -2, -100}, {100, -2, 100}};
    const auto onFloor = receiverRanges({&floor, 1}, {&view, 1});
    EXPECT_NEAR(onFloor[0].nearest, 2.0 / std::tan(0.4), 1e-9);
    EXPECT_NEAR(onFloor[0].farthest, 110.0, 1e-9);
    EXPECT_TRUE(receiverRanges({}, {&view, 1})[0].boundsWorld.empty());
    EXPECT_TRUE(receiverRanges(parts, {}).empty());
}

// Whatever a view sees of the parts is in its range and on every map that is fitted to it.
void checkHolds(bool spot) {
    const auto unit = [] { return *rc::gen::inRange(-1000, 1001) * 0.001; };
    const double scale = std::pow(10.0, *rc::gen::inRange(-3, 5));
    std::vector<Box3d> parts;
    Box3d scene;
    for (int i = *rc::gen::inRange(1, 12); i > 0; --i) {
        const glm::dvec3 middle = scale * glm::dvec3(60 * unit(), 4 + 4 * unit(), 60 * unit());
        const glm::dvec3 half = scale * glm::dvec3(1.0 + unit(), 1.0 + unit(), 20 * (1.0 + unit()));
        parts.push_back({middle - half, middle + half});
        scene.include(parts.back());
    }
    std::vector<View> views;
    for (int i = *rc::gen::inRange(1, 4); i > 0; --i) {
        const glm::dvec3 eye = scale * 70.0 * glm::dvec3(unit(), 0.3 * unit() + 0.2, unit());
        const glm::dvec3 target = scale * 60.0 * glm::dvec3(unit(), 0.1 * unit(), unit());
        RC_PRE(glm::distance(eye, target) > 0.1 * scale);
        views.push_back(viewFrom(eye, target, *rc::gen::element(0.05, 0.8, 2.0)));
    }
    const auto ranges = receiverRanges(parts, views);
    ShadowFitRequest request;
    request.mode = request.map =
        *rc::gen::element(ShadowMode::Perspective, ShadowMode::LightSpacePerspective, ShadowMode::Trapezoid);
    request.mapSize = 512;
    request.tight = true;
    const glm::dvec3 position = scale * glm::dvec3(70 * unit(), 40 + 30 * unit(), 70 * unit());
    const glm::dvec3 direction = spot ? glm::dvec3(unit(), -1.0, unit()) : glm::dvec3(unit(), unit(), unit());
    RC_PRE(glm::length(direction) > 0.01);
    const auto fit = spot ? fitSpot(position, direction, 0.7, 0.0, scene, views, request, ranges)
                          : fitDirectional(direction, scene, views, request, ranges);
    for (int i = 0; i < 100; ++i) {
        const Box3d& part = parts[static_cast<std::size_t>(*rc::gen::inRange(0, static_cast<int>(parts.size())))];
        const glm::dvec3 receiver = part.centre() + 0.5 * part.size() * glm::dvec3(unit(), unit(), unit());
        bool seen = false;
        for (std::size_t v = 0; v < views.size(); ++v) {
            if (!isSeen(views[v], receiver)) continue;
            seen = true;
            const double depth = depthOf(views[v], receiver), slack = 1e-9 * scale * 100.0;
            RC_ASSERT(depth >= ranges[v].nearest - slack && depth <= ranges[v].farthest + slack);
        }
        const glm::dvec3 fromLight = receiver - position;
        if (spot && (glm::dot(fromLight, glm::normalize(direction)) < std::cos(0.7) * glm::length(fromLight) ||
                     glm::length(fromLight) < 0.1 * scale))
            seen = false;
        if (!seen) continue;
        RC_ASSERT(fit.has_value());
        RC_ASSERT(isOnMap(*fit, receiver));
    }
}
RC_GTEST_PROP(ReceiverRange, DirectionalFitsHoldWhatIsSeen, ()) {
    checkHolds(false);
}
RC_GTEST_PROP(ReceiverRange, SpotFitsHoldWhatIsSeen, ()) {
    checkHolds(true);
}

class Parts : public SceneFixture {};

TEST_F(Parts, AreSmallAndHoldEveryTriangle) {
    // A floor of 64 x 64 quads, row by row, turned and moved.
    const auto floor = aspect.create<Geometry>("floor");
    std::vector<glm::vec3> positions;
    std::vector<std::uint32_t> indices;
    for (int y = 0; y <= 64; ++y)
        for (int x = 0; x <= 64; ++x) positions.emplace_back(float(x), 0.0f, float(y));
    for (std::uint32_t y = 0; y < 64; ++y)
        for (std::uint32_t x = 0; x < 64; ++x)
            for (const std::uint32_t corner : {0u, 1u, 66u, 0u, 66u, 65u}) indices.push_back(y * 65 + x + corner);
    aspect.edit(floor).assign<&Geometry::positions>(positions).assign<&Geometry::indices>(indices);
    node(placed(root, {100, 5, 0}, glm::mat3(0, 0, -1, 0, 1, 0, 1, 0, 0)), any(floor));
    GeometryBounds bounds;
    const auto parts = partBounds(aspect, root, bounds);
    EXPECT_EQ(parts.size(), 64u);
    const Box3d whole = worldBounds(aspect, root);
    Box3d together;
    for (const Box3d& part : parts) {
        together.include(part);
        EXPECT_LE(part.size().x * part.size().z, 64.0 + 1e-9);
    }
    EXPECT_EQ(together, whole);
    for (std::size_t i = 0; i < indices.size(); i += 3) {
        const glm::dvec3 p(positions[indices[i]]);
        EXPECT_TRUE(parts[i / (3 * GeometryBounds::kPartTriangles)].contains({100 + p.z, 5, -p.x})) << i;
    }
    // Kept while nothing is written, made anew when something is.
    EXPECT_EQ(&bounds.parts(*aspect.find(floor)), &bounds.parts(*aspect.find(floor)));
    positions.back() = {64, 9, 64};
    aspect.edit(floor).assign<&Geometry::positions>(positions);
    EXPECT_EQ(partBounds(aspect, root, bounds).back().upper.y, 14.0);
}

}  // namespace
}  // namespace umbriel
