#include "common/math/frustum.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "common/math/projection.h"
#include "common/math/rotation.h"

namespace umbriel {
namespace {

TEST(Frustum, PlanesAreThoseOfThePicture) {
    const Frustum frustum = frustumOf(reversedPerspective(std::numbers::pi / 2.0, 1.0, 0.5, 10.0));
    const double h = std::sqrt(0.5);
    const glm::dvec3 normals[] = {{h, 0, -h}, {-h, 0, -h}, {0, h, -h}, {0, -h, -h}, {0, 0, -1}, {0, 0, 1}};
    const double offsets[] = {0, 0, 0, 0, -0.5, 10.0};
    for (std::size_t i = 0; i < 6; ++i) {
        EXPECT_LT(glm::distance(frustum.planes[i].normal, normals[i]), 1e-12) << i;
        EXPECT_NEAR(frustum.planes[i].offset, offsets[i], 1e-12) << i;
    }
}

TEST(Frustum, AnInfiniteFarPlaneHoldsNothingBack) {
    const Frustum frustum = frustumOf(reversedPerspective(1.0, 1.0, 0.5));
    EXPECT_TRUE(mayIntersect(frustum, {glm::dvec3(-1, -1, -1e300), glm::dvec3(1, 1, -1e299)}));
    EXPECT_FALSE(mayIntersect(frustum, {glm::dvec3(-1, -1, -0.4), glm::dvec3(1, 1, 7.0)}));
}

TEST(Frustum, EmptyBoxesAreOutsideAndPointsAreBoxes) {
    const Frustum frustum = frustumOf(reversedPerspective(1.0, 1.0, 0.5));
    EXPECT_FALSE(mayIntersect(frustum, Box3d{}));
    EXPECT_FALSE(surelyContains(frustum, Box3d{}));
    const glm::dvec3 inside(0, 0, -2);
    EXPECT_TRUE(mayIntersect(frustum, {inside, inside}));
    EXPECT_TRUE(surelyContains(frustum, {inside, inside}));
}

// No box that shows a point in the picture is ever said to be outside, at any of the extreme fields of view.
RC_GTEST_PROP(Frustum, NothingVisibleIsCulled, ()) {
    const double fov = *rc::gen::element(1e-3, 1.0, 45.0, 120.0, 179.0) * std::numbers::pi / 180.0;
    const double nearDistance = *rc::gen::element(1e-3, 0.1, 10.0);
    const bool infinite = *rc::gen::arbitrary<bool>();
    const glm::dmat4 clipFromView =
        infinite ? reversedPerspective(fov, 1.6, nearDistance) : reversedPerspective(fov, 1.6, nearDistance, 1e7);
    const auto unit = [] { return *rc::gen::inRange(-1000, 1001) * 0.001; };
    const glm::dvec3 forward(unit(), unit(), unit());
    RC_PRE(glm::length(forward) > 0.0);
    const glm::dmat3 worldFromView = *rotationLookingAlong(forward, {0, 1, 0});
    const Frustum frustum = frustumOf(clipFromView * glm::dmat4(glm::transpose(worldFromView)));
    // A point in the picture, its edges included, and a box around or touching it.
    const double distance = nearDistance * std::pow(1e7 / nearDistance, 0.5 + 0.4999 * unit());
    const double tangent = std::tan(0.5 * fov) * distance;
    const glm::dvec3 seen = worldFromView * glm::dvec3(unit() * tangent * 1.6, unit() * tangent, -distance);
    const double size = std::pow(10.0, *rc::gen::inRange(-6, 6));
    const Box3d box{seen - size * glm::abs(glm::dvec3(unit(), unit(), unit())),
                    seen + size * glm::abs(glm::dvec3(unit(), unit(), unit()))};
    RC_ASSERT(mayIntersect(frustum, box));
}

RC_GTEST_PROP(Frustum, WhatIsContainedHasItsCornersInThePicture, ()) {
    const auto unit = [] { return *rc::gen::inRange(-1000, 1001) * 0.001; };
    const glm::dmat4 clip = reversedPerspective(1.2, 1.0, 0.1, 50.0);
    const Frustum frustum = frustumOf(clip);
    const glm::dvec3 a(10 * unit(), 10 * unit(), -25 + 25 * unit());
    const Box3d box{a, a + 5.0 * glm::abs(glm::dvec3(unit(), unit(), unit()))};
    bool all = true;
    for (int i = 0; i < 8; ++i) {
        const glm::dvec4 c = clip * glm::dvec4(box.corner(i), 1.0);
        all = all && std::abs(c.x) <= c.w && std::abs(c.y) <= c.w && c.z >= 0.0 && c.z <= c.w;
    }
    RC_ASSERT(!surelyContains(frustum, box) || all);
    if (all) RC_ASSERT(mayIntersect(frustum, box));
}

RC_GTEST_PROP(Box, TransformedBoxHoldsTheTransformedCorners, ()) {
    const auto number = [] { return *rc::gen::inRange(-100000, 100001) * 0.001; };
    Affine affine;
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) affine.linear[c][r] = number();
    affine.translation = {number() * 1e4, number(), number()};
    Box3d box;
    box.include(glm::dvec3(number(), number(), number()));
    box.include(glm::dvec3(number(), number(), number()));
    const Box3d moved = transformed(affine, box);
    for (int i = 0; i < 8; ++i) {
        const glm::dvec3 p = affine.point(box.corner(i));
        RC_ASSERT(glm::all(glm::lessThanEqual(moved.lower - 1e-6, p)) &&
                  glm::all(glm::lessThanEqual(p, moved.upper + 1e-6)));
    }
    RC_ASSERT(transformed(affine, Box3d{}).empty());
}

TEST(Rotation, LooksWhereItShouldWithUpAbove) {
    const auto turn = rotationLookingAlong({0, 0, -5}, {0, 3, 0});
    ASSERT_TRUE(turn);
    EXPECT_EQ(*turn, glm::dmat3(1.0));
}

RC_GTEST_PROP(Rotation, IsARotationForEveryDirection, ()) {
    const double scale = std::pow(10.0, *rc::gen::inRange(-300, 300));
    const auto unit = [] { return *rc::gen::element(-1.0, -1e-9, 0.0, 1e-7, 0.5, 1.0); };
    const glm::dvec3 forward = scale * glm::dvec3(unit(), unit(), unit());
    const glm::dvec3 up(unit(), unit(), unit());
    const auto turn = rotationLookingAlong(forward, up);
    RC_ASSERT(turn.has_value() == (forward != glm::dvec3(0.0)));
    if (!turn) return;
    const glm::dmat3 identity = glm::transpose(*turn) * *turn;
    for (int c = 0; c < 3; ++c) RC_ASSERT(glm::distance(identity[c], glm::dmat3(1.0)[c]) < 1e-12);
    RC_ASSERT(glm::determinant(*turn) > 0.0);
    RC_ASSERT(glm::dot((*turn)[2], forward / scale) < 0.0);
}

TEST(Rotation, OrthonormalisedDropsScaleShearAndMirrors) {
    const glm::dmat3 turn = *rotationLookingAlong({1, -2, 0.5}, {0, 1, 0});
    for (const glm::dmat3& extra : {glm::dmat3(2, 0, 0, 0, 3, 0, 0, 0, 0.001), glm::dmat3(-1, 0, 0, 0, 1, 0, 0, 0, 1),
                                    glm::dmat3(1, 0, 0, 0.4, 1, 0, 0, 0, 1)}) {
        const auto result = orthonormalised(turn * extra);
        ASSERT_TRUE(result);
        EXPECT_LT(glm::distance((*result)[2], turn[2]), 1e-12);
        EXPECT_NEAR(glm::determinant(*result), 1.0, 1e-12);
    }
    EXPECT_FALSE(orthonormalised(glm::dmat3(0.0)));
    EXPECT_FALSE(orthonormalised(glm::dmat3(NAN)));
}

}  // namespace
}  // namespace umbriel
