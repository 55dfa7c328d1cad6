#include "client/session/seen_places.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "client/session/convex_body.h"
#include "common/math/projection.h"
#include "common/math/rotation.h"

namespace umbriel {
namespace {

View viewFrom(const glm::dvec3& eye, const glm::dvec3& target, double fovY = 0.8) {
    View view;
    view.eyeWorld = eye;
    view.viewFromWorld = glm::transpose(*rotationLookingAlong(target - eye, {0, 1, 0}));
    view.clipFromView = reversedPerspective(fovY, 16.0 / 9.0, 0.1);
    view.nearDistance = 0.1;
    return view;
}

double depthOf(const View& view, const glm::dvec3& relative) {
    return -(view.viewFromWorld * relative).z;
}

// Of the box within the frustum, as the fits ask.
std::vector<SeenPlace> placesOf(const View& view, const Box3d& box, double leastDepth,
                                std::span<const Plane> planes = {}) {
    ConvexBody body(box, view.eyeWorld);
    for (const Plane& plane : frustumOf(view.clipFromView * glm::dmat4(view.viewFromWorld)).planes)
        if (plane.normal != glm::dvec3(0.0)) body.cut(plane);
    return seenPlaces(view, box, body.corners(), planes, leastDepth);
}

double weightOf(const std::vector<SeenPlace>& places) {
    double sum = 0.0;
    for (const SeenPlace& place : places) sum += place.weight;
    return sum;
}

// A block that fills the picture from 10 to 80 m: every ray has the logarithm of its ends, and its places lie a third
// of that apart.
TEST(SeenPlaces, AreEquallyFarApartInTheLogarithmOfDepth) {
    const View view = viewFrom({5, 6, 100}, {5, 6, 0});
    const Box3d box{{-200, -200, 20}, {200, 200, 90}};
    const double wider = box.diagonal() / 64.0;
    const double from = 10.0 - wider, to = 80.0 + wider, step = std::log(to / from) / 3.0;
    const auto places = placesOf(view, box, 1e-3);
    ASSERT_EQ(places.size(), 6u * 6u * 3u);
    for (std::size_t i = 0; i < places.size(); ++i) {
        EXPECT_NEAR(places[i].depth, from * std::exp((static_cast<double>(i % 3) + 0.5) * step), 1e-9);
        EXPECT_NEAR(depthOf(view, places[i].relative), places[i].depth, 1e-9);
        EXPECT_NEAR(places[i].weight, step, 1e-12);
    }
    // Planes take what is behind them; nearer than the least depth counts as there.
    const Plane nearHalf{{0, 0, 1}, 40.0};
    for (const SeenPlace& place : placesOf(view, box, 30.0, {&nearHalf, 1})) {
        EXPECT_GE(place.depth, 30.0);
        EXPECT_LE(place.depth, 40.0 + wider);
        EXPECT_NEAR(place.depth, std::max(30.0, depthOf(view, place.relative)), 1e-9);
    }
}

RC_GTEST_PROP(SeenPlaces, LieInThePictureAndInTheWidenedBox, ()) {
    const auto unit = [] { return *rc::gen::inRange(-1000, 1001) * 0.001; };
    const double scale = std::pow(10.0, *rc::gen::inRange(-3, 5));
    const glm::dvec3 eye = scale * 70.0 * glm::dvec3(unit(), unit(), unit());
    const glm::dvec3 target = scale * 60.0 * glm::dvec3(unit(), unit(), unit());
    RC_PRE(glm::distance(eye, target) > 0.1 * scale);
    const View view = viewFrom(eye, target, *rc::gen::element(0.05, 0.8, 2.0, 3.1));
    const Box3d box{scale * glm::dvec3(-60, 0, -60), scale * glm::dvec3(60, *rc::gen::element(0.0, 8.0), 60)};
    const double wider = box.diagonal() / 64.0 * (1.0 + 1e-9);
    for (const SeenPlace& place : placesOf(view, box, scale)) {
        RC_ASSERT(std::isfinite(place.depth) && place.depth >= scale && place.weight > 0.0);
        const glm::dvec4 clip = view.clipFromView * glm::dvec4(view.viewFromWorld * place.relative, 1.0);
        RC_ASSERT(clip.w > 0.0 && std::abs(clip.x) < clip.w && std::abs(clip.y) < clip.w);
        const glm::dvec3 world = place.relative + eye;
        for (int axis = 0; axis < 3; ++axis)
            RC_ASSERT(world[axis] >= box.lower[axis] - wider && world[axis] <= box.upper[axis] + wider);
    }
}

// While the view turns, rays come to the box and leave it; a hundredth of the step changes a hundredth.
TEST(SeenPlaces, ComeAndGoByDegrees) {
    const Box3d box{{-20, 0, -20}, {20, 5, 20}};
    const auto largestChange = [&](double step) {
        double largest = 0.0, last = -1.0;
        for (int i = 0; i < 400; ++i) {
            const double angle = 0.3 + i * step;
            const View view = viewFrom({0, 9, 60}, {60.0 * std::sin(angle), 3, 60.0 - 60.0 * std::cos(angle)});
            const double weight = weightOf(placesOf(view, box, 1.0));
            if (last >= 0.0) largest = std::max(largest, std::abs(weight - last));
            last = weight;
        }
        return largest;
    };
    const double coarse = largestChange(1e-3);
    EXPECT_GT(coarse, 0.0);
    EXPECT_LE(largestChange(1e-5), 0.03 * coarse);
}

TEST(SeenPlaces, OfFlatAndEmptyBoxes) {
    const View view = viewFrom({0, 3, 20}, {0, 0, 0});
    const auto onFloor = placesOf(view, {{-5, 0, -5}, {5, 0, 5}}, 1.0);
    ASSERT_FALSE(onFloor.empty());  // though it is a small part of the picture
    EXPECT_GT(weightOf(onFloor), 0.0);
    EXPECT_TRUE(placesOf(view, {}, 1.0).empty());
    EXPECT_TRUE(placesOf(view, {{0, 0, 0}, {0, 0, 0}}, 1.0).empty());
    EXPECT_TRUE(placesOf(view, {{-5, 0, 40}, {5, 1, 50}}, 1.0).empty()) << "behind the eye";
}

TEST(SeenPlaces, OfAnOrthographicViewAreNoNearer) {
    View view = viewFrom({0, 10, 50}, {0, 0, 0});
    view.clipFromView = reversedOrthographic(-30, 30, -20, 20, 0.1, 500.0);
    view.orthographic = true;
    const auto places = placesOf(view, {{-60, 0, -60}, {60, 8, 60}}, 1.0);
    ASSERT_FALSE(places.empty());
    for (const SeenPlace& place : places) {
        EXPECT_EQ(place.depth, 1.0);
        const glm::dvec3 inView = view.viewFromWorld * place.relative;
        EXPECT_LT(std::abs(inView.x), 30.0);
        EXPECT_LT(std::abs(inView.y), 20.0);
    }
}

}  // namespace
}  // namespace umbriel
