#include <gtest/gtest.h>

#include <cmath>

#include "shaders/formula_cpp.h"

namespace umbriel {
namespace {

namespace f = formula_f64;
using glm::dvec3;

f::AffineMap mapOf(const glm::dmat3& linear, const dvec3& origin = dvec3(0.0)) {
    return {linear[0], linear[1], linear[2], origin};
}

glm::dmat3 turnedAboutZ(double angle) {
    return {std::cos(angle), std::sin(angle), 0.0, -std::sin(angle), std::cos(angle), 0.0, 0.0, 0.0, 1.0};
}

void expectNear(const dvec3& a, const dvec3& b, double tolerance = 1e-15) {
    EXPECT_LE(glm::length(a - b), tolerance) << a.x << " " << a.y << " " << a.z;
}

TEST(FormulaDeformation, AMapTakesPointsAndLeavesDirectionsInPlace) {
    const f::AffineMap map = mapOf(turnedAboutZ(std::acos(0.0)), {10, 20, 30});
    expectNear(f::mappedPoint(map, {1, 2, 3}), {8, 21, 33}, 1e-14);
    expectNear(f::mappedDirection(map, {1, 2, 3}), {-2, 1, 3}, 1e-14);
}

// Halfway between a quarter turn to either side is no rotation: linear blending shrinks to cos 45 degrees.
TEST(FormulaDeformation, HalfOfTwoOppositeTurnsShrinks) {
    const double eighth = std::atan(1.0);
    const f::AffineMap blend = f::sumOfMaps(f::weightedMap(mapOf(turnedAboutZ(eighth)), 0.5),
                                            f::weightedMap(mapOf(turnedAboutZ(-eighth)), 0.5));
    expectNear(f::mappedPoint(blend, {1, 0, 7}), {std::sqrt(0.5), 0, 7});
}

// The plane x + y = 1, stretched by 2 along x, is x / 2 + y = 1.
TEST(FormulaDeformation, NormalsStayPerpendicularUnderStretchingAndShear) {
    const f::AffineMap stretched = mapOf({2, 0, 0, 0, 1, 0, 0, 0, 1});
    expectNear(f::mappedSurfaceNormal(stretched, glm::normalize(dvec3(1, 1, 0))), glm::normalize(dvec3(0.5, 1, 0)));
    const glm::dmat3 shear(1, 0.7, -0.2, 0.1, 3, 0.4, 0.3, -0.5, 0.6);
    const dvec3 u(1, 2, 3), v(-2, 1, 0.5);
    const dvec3 normal = f::mappedSurfaceNormal(mapOf(shear), glm::normalize(glm::cross(u, v)));
    EXPECT_NEAR(glm::dot(normal, shear * u), 0.0, 1e-14);
    EXPECT_NEAR(glm::dot(normal, shear * v), 0.0, 1e-14);
}

TEST(FormulaDeformation, AMirroredSurfaceKeepsItsOutside) {
    const f::AffineMap mirror = mapOf({-1, 0, 0, 0, 1, 0, 0, 0, 1});
    expectNear(f::mappedSurfaceNormal(mirror, {1, 0, 0}), {-1, 0, 0});
    expectNear(f::mappedSurfaceNormal(mirror, {0, 0, 1}), {0, 0, 1});
}

// A limb scaled to nothing, and one flattened: the first has no normal but its own, the second that of its plane.
TEST(FormulaDeformation, FlattenedSurfacesHaveNormals) {
    expectNear(f::mappedSurfaceNormal(mapOf(glm::dmat3(0.0)), {0, 0.6, 0.8}), {0, 0.6, 0.8});
    expectNear(f::mappedSurfaceNormal(mapOf({1, 0, 0, 0, 1, 0, 0, 0, 0}), glm::normalize(dvec3(1, 1, 1))), {0, 0, 1});
}

TEST(FormulaDeformation, TinyAndHugeTrianglesHaveNormals) {
    for (const float scale : {1e-30f, 1.0f, 1e30f}) {
        const glm::vec3 n = formula_f32::triangleNormal(glm::vec3(0), glm::vec3(scale, 0, 0), glm::vec3(0, scale, 0));
        EXPECT_EQ(n, glm::vec3(0, 0, 1)) << scale;
        const glm::vec3 sheared = formula_f32::mappedSurfaceNormal(
            {glm::vec3(scale, 0, 0), glm::vec3(0, scale, 0), glm::vec3(0, 0, scale), glm::vec3(0)}, glm::vec3(0, 1, 0));
        EXPECT_EQ(sheared, glm::vec3(0, 1, 0)) << scale;
    }
    EXPECT_EQ(formula_f32::triangleNormal(glm::vec3(1), glm::vec3(1), glm::vec3(2)), glm::vec3(0, 0, 1)) << "no area";
}

}  // namespace
}  // namespace umbriel
