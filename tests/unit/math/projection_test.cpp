#include "common/math/projection.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numbers>

#include "common/math/affine.h"

namespace umbriel {
namespace {

glm::dvec3 project(const glm::dmat4& clipFromView, const glm::dvec3& view) {
    const glm::dvec4 clip = clipFromView * glm::dvec4(view, 1.0);
    return glm::dvec3(clip) / clip.w;
}

constexpr double kDegree = std::numbers::pi / 180.0;

// Every field of view and depth range that the accuracy spec names (60, section 2).
struct Extreme {
    double fovY, aspect, nearDistance, farDistance;
};
const Extreme kExtremes[] = {{1e-3 * kDegree, 1.0, 1e-3, 1e7},   {179.0 * kDegree, 16.0 / 9.0, 1e-3, 1e7},
                             {45.0 * kDegree, 1e-3, 1.0, 1.001}, {90.0 * kDegree, 1e3, 1e-6, 1e6},
                             {179.0 * kDegree, 1.0, 1e7, 1e8},   {1e-3 * kDegree, 2.0, 1e6, 2e6}};

TEST(Projection, CornersAndDepthsArriveWhereTheyShould) {
    for (const Extreme& e : kExtremes) {
        const double tangent = std::tan(0.5 * e.fovY);
        for (const bool infinite : {false, true}) {
            const glm::dmat4 clipFromView = infinite
                                                ? reversedPerspective(e.fovY, e.aspect, e.nearDistance)
                                                : reversedPerspective(e.fovY, e.aspect, e.nearDistance, e.farDistance);
            ASSERT_TRUE(isFinite(clipFromView));
            for (const double distance : {e.nearDistance, std::sqrt(e.nearDistance * e.farDistance), e.farDistance}) {
                const glm::dvec3 corner(tangent * e.aspect * distance, -tangent * distance, -distance);
                const glm::dvec3 ndc = project(clipFromView, corner);
                EXPECT_NEAR(ndc.x, 1.0, 1e-12);
                EXPECT_NEAR(ndc.y, -1.0, 1e-12);
                // depth = near / distance, less its share at the far plane (both affine in 1 / distance).
                const double depth =
                    infinite ? e.nearDistance / distance
                             : (1.0 / distance - 1.0 / e.farDistance) / (1.0 / e.nearDistance - 1.0 / e.farDistance);
                EXPECT_NEAR(ndc.z, depth, 1e-12 * (1.0 + e.farDistance / (e.farDistance - e.nearDistance)));
            }
        }
    }
}

TEST(Projection, DepthFallsWithDistance) {
    for (const Extreme& e : kExtremes) {
        const glm::dmat4 clipFromView = reversedPerspective(e.fovY, e.aspect, e.nearDistance, e.farDistance);
        double last = 1.0 + 1e-12;
        for (int i = 0; i <= 100; ++i) {
            const double distance = e.nearDistance * std::pow(e.farDistance / e.nearDistance, i / 100.0);
            const double depth = project(clipFromView, {0, 0, -distance}).z;
            EXPECT_LT(depth, last);
            last = depth - 1e-13;
        }
    }
}

TEST(Projection, OrthographicMapsItsVolumeToTheClipBox) {
    const glm::dmat4 clipFromView = reversedOrthographic(-2.0, 6.0, 1.0, 3.0, -5.0, 10.0);
    EXPECT_EQ(project(clipFromView, {-2.0, 1.0, 5.0}), glm::dvec3(-1.0, -1.0, 1.0));
    EXPECT_EQ(project(clipFromView, {6.0, 3.0, -10.0}), glm::dvec3(1.0, 1.0, 0.0));
    EXPECT_EQ(project(clipFromView, {2.0, 2.0, -2.5}), glm::dvec3(0.0, 0.0, 0.5));
}

TEST(Projection, ReversedFromOpenGlTurnsDepthRoundAndKeepsThePlace) {
    const glm::dmat4 openGl = glm::perspective(0.9, 1.5, 0.25, 80.0);
    const glm::dmat4 ours = reversedFromOpenGl(openGl);
    const glm::dmat4 expected = reversedPerspective(0.9, 1.5, 0.25, 80.0);
    for (const glm::dvec3& view : {glm::dvec3(0.1, 0.2, -0.25), glm::dvec3(3, -4, -20), glm::dvec3(1, 1, -80)}) {
        const glm::dvec3 a = project(ours, view), b = project(expected, view);
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], 1e-12);
    }
}

// Tiles of a wall: a point at fractions (u, v) of the picture is at the same fractions of the part.
RC_GTEST_PROP(Cropped, PointsKeepTheirPixel, ()) {
    const PixelSize wall{*rc::gen::inRange(1, 32768), *rc::gen::inRange(1, 32768)};
    const int x = *rc::gen::inRange(0, wall.width), y = *rc::gen::inRange(0, wall.height);
    const PixelRect part{x, y, *rc::gen::inRange(1, wall.width - x + 1), *rc::gen::inRange(1, wall.height - y + 1)};
    const glm::dmat4 whole = reversedPerspective(1.0, static_cast<double>(wall.width) / wall.height, 0.1);
    const glm::dmat4 crop = cropped(whole, part, wall);
    const glm::dvec3 view(*rc::gen::inRange(-100, 101) * 0.01, *rc::gen::inRange(-100, 101) * 0.01,
                          -1.0 - *rc::gen::inRange(0, 1000));
    const glm::dvec3 a = project(whole, view), b = project(crop, view);
    const double pixelX = (a.x * 0.5 + 0.5) * wall.width, pixelY = (a.y * 0.5 + 0.5) * wall.height;
    RC_ASSERT(std::abs((b.x * 0.5 + 0.5) * part.width + part.x - pixelX) < 1e-9 * wall.width);
    RC_ASSERT(std::abs((b.y * 0.5 + 0.5) * part.height + part.y - pixelY) < 1e-9 * wall.height);
    RC_ASSERT(a.z == b.z);
}

TEST(Cropped, TheWholeIsItself) {
    const glm::dmat4 whole = reversedPerspective(1.0, 1.5, 0.1);
    EXPECT_EQ(cropped(whole, {0, 0, 1277, 719}, {1277, 719}), whole);
}

TEST(GeneralisedPerspective, AnEyeBeforeTheMiddleSeesASymmetricFrustum) {
    const auto projection = generalisedPerspective({-2, -1, -3}, {2, -1, -3}, {-2, 1, -3}, {0, 0, 0}, 0.1);
    ASSERT_TRUE(projection);
    const glm::dmat4 expected = reversedPerspective(2.0 * std::atan(1.0 / 3.0), 2.0, 0.1);
    for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 4; ++r) EXPECT_NEAR(projection->clipFromView[c][r], expected[c][r], 1e-14);
    EXPECT_EQ(projection->viewFromWorld, glm::dmat3(1.0));
}

// Whatever the eye: the screen's corners are the corners of the picture.
RC_GTEST_PROP(GeneralisedPerspective, ScreenCornersAreThePicturesCorners, ()) {
    const auto number = [](int low, int high) { return *rc::gen::inRange(low, high) * 0.001; };
    const glm::dvec3 forward = glm::dvec3(number(-1000, 1000), number(-1000, 1000), number(-1000, 1000));
    RC_PRE(glm::length(forward) > 0.01);
    const glm::dvec3 normal = glm::normalize(forward);
    const glm::dvec3 right =
        glm::normalize(glm::cross(std::abs(normal.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0), normal));
    const glm::dvec3 up = glm::cross(normal, right);
    const glm::dvec3 corner(number(-5000, 5000), number(-5000, 5000), number(-5000, 5000));
    const double width = 0.1 + number(0, 9000), height = 0.1 + number(0, 9000);
    const double distance = 0.01 + number(0, 5000);
    const glm::dvec3 eye = corner + distance * normal + number(-20000, 20000) * right + number(-20000, 20000) * up;
    const glm::dvec3 lowerRight = corner + width * right, upperLeft = corner + height * up;
    const auto projection = generalisedPerspective(corner, lowerRight, upperLeft, eye, 0.01);
    RC_ASSERT(projection.has_value());
    const auto seen = [&](const glm::dvec3& world) {
        return project(projection->clipFromView, projection->viewFromWorld * (world - eye));
    };
    const double tolerance = 1e-9 * (1.0 + 40.0 / std::min(width, height));
    RC_ASSERT(glm::distance(glm::dvec2(seen(corner)), glm::dvec2(-1, -1)) < tolerance);
    RC_ASSERT(glm::distance(glm::dvec2(seen(lowerRight)), glm::dvec2(1, -1)) < tolerance);
    RC_ASSERT(glm::distance(glm::dvec2(seen(upperLeft)), glm::dvec2(-1, 1)) < tolerance);
}

TEST(GeneralisedPerspective, RefusesWhatIsNoScreenOrNotInFrontOfTheEye) {
    const glm::dvec3 ll(-1, -1, 0), lr(1, -1, 0), ul(-1, 1, 0);
    EXPECT_TRUE(generalisedPerspective(ll, lr, ul, {0, 0, 1}, 0.1));
    EXPECT_FALSE(generalisedPerspective(ll, lr, ul, {0, 0, -1}, 0.1));
    EXPECT_FALSE(generalisedPerspective(ll, lr, ul, {5, 0, 0}, 0.1));
    EXPECT_FALSE(generalisedPerspective(ll, ll, ul, {0, 0, 1}, 0.1));
    EXPECT_FALSE(generalisedPerspective(ll, lr, {-0.5, 1, 0}, {0, 0, 1}, 0.1));
    EXPECT_FALSE(generalisedPerspective(ll, lr, ul, {0, NAN, 1}, 0.1));
    EXPECT_FALSE(generalisedPerspective(ll, lr, ul, {0, 0, 1}, 0.0));
}

}  // namespace
}  // namespace umbriel
