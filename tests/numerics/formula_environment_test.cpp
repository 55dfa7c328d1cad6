#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "shaders/formula_cpp.h"
#include "tests/numerics/points.h"

namespace umbriel {
namespace {

namespace f = formula_f64;
using glm::dvec2;
using glm::dvec3;

constexpr double kPi = std::numbers::pi;

TEST(FormulaEnvironment, PanoramaLooksAlongMinusZ) {
    EXPECT_EQ(f::latLongFromDirection(dvec3(0, 0, -1)), dvec2(0.5, 0.5));
    EXPECT_EQ(f::latLongFromDirection(dvec3(1, 0, 0)), dvec2(0.75, 0.5)) << "+X is to the right";
    EXPECT_EQ(f::latLongFromDirection(dvec3(-1, 0, 0)), dvec2(0.25, 0.5));
    EXPECT_EQ(f::latLongFromDirection(dvec3(0, 1, 0)).y, 0);
    EXPECT_EQ(f::latLongFromDirection(dvec3(0, -1, 0)).y, 1);
    EXPECT_NEAR(f::latLongFromDirection(dvec3(1e-9, 0, 1)).x, 1, 1e-9) << "the seam is behind";
    EXPECT_NEAR(f::latLongFromDirection(dvec3(-1e-9, 0, 1)).x, 0, 1e-9);
}

TEST(FormulaEnvironment, PanoramaAndCubeComeBackToTheDirection) {
    numerics::Sequence sequence(31);
    for (int i = 0; i < 20000; ++i) {
        const dvec3 d = glm::normalize(dvec3(sequence.direction()));
        ASSERT_LT(glm::distance(f::directionFromLatLong(f::latLongFromDirection(d)), d), 1e-14);
        const dvec3 again = f::directionFromCube(f::cubeFace(d), f::cubePlace(d));
        ASSERT_LT(glm::distance(glm::normalize(again), d), 1e-14);
        const dvec2 place = f::cubePlace(d);
        ASSERT_TRUE(place.x >= 0 && place.x <= 1 && place.y >= 0 && place.y <= 1);
    }
}

// OpenGL 4.5, table 8.19: major axis, sc, tc; place = (sc / |ma| + 1) / 2.
TEST(FormulaEnvironment, CubeFacesAreThoseOfOpenGl) {
    const struct {
        dvec3 direction;
        int face;
        dvec2 place;
    } known[] = {{{1, 0.5, 0.25}, 0, {(-0.25 + 1) / 2, (-0.5 + 1) / 2}},
                 {{-1, 0.5, 0.25}, 1, {(0.25 + 1) / 2, 0.25}},
                 {{0.5, 1, 0.25}, 2, {0.75, (0.25 + 1) / 2}},
                 {{0.5, -1, 0.25}, 3, {0.75, (-0.25 + 1) / 2}},
                 {{0.5, 0.25, 1}, 4, {0.75, (-0.25 + 1) / 2}},
                 {{0.5, 0.25, -1}, 5, {0.25, (-0.25 + 1) / 2}}};
    for (const auto& k : known) {
        EXPECT_EQ(f::cubeFace(k.direction), k.face);
        EXPECT_EQ(f::cubePlace(k.direction), k.place) << k.face;
    }
    EXPECT_EQ(f::cubePlace(dvec3(0)), dvec2(0.5)) << "no direction";
}

TEST(FormulaEnvironment, TexelsOfAPanoramaCoverTheSphere) {
    double sum = 0;
    for (int row = 0; row < 90; ++row) {
        const double angle = f::latLongTexelSolidAngle(row, 180, 90);
        EXPECT_NEAR(angle, 2 * kPi / 180 * (std::cos(row * kPi / 90) - std::cos((row + 1) * kPi / 90)), 1e-15);
        sum += 180 * angle;
    }
    EXPECT_NEAR(sum, 4 * kPi, 1e-12);
}

TEST(FormulaEnvironment, TexelsOfACubeCoverTheSphere) {
    constexpr int kSize = 64;
    double sum = 0;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            sum += 6 * f::cubeTexelSolidAngle(dvec2((x + 0.5) / kSize, (y + 0.5) / kSize), kSize);
    // To first order; the error of the midpoint rule falls with the square of the texel.
    EXPECT_NEAR(sum, 4 * kPi, 1e-3);
    EXPECT_NEAR(f::cubeTexelSolidAngle(dvec2(0.5), 2), 1, 1e-15);
    EXPECT_NEAR(f::cubeTexelSolidAngle(dvec2(0, 0), 2), std::pow(3.0, -1.5), 1e-15);
}

TEST(FormulaEnvironment, ConvolutionOfEvenLightIsThatLight) {
    const dvec3 normal = glm::normalize(dvec3(0.3, 0.8, -0.4));
    constexpr int kRows = 200;
    constexpr int kColumns = 400;
    double sum = 0;
    for (int row = 0; row < kRows; ++row)
        for (int column = 0; column < kColumns; ++column)
            sum += f::diffuseConvolutionWeight(
                normal, f::directionFromLatLong(dvec2((column + 0.5) / kColumns, (row + 0.5) / kRows)),
                f::latLongTexelSolidAngle(row, kColumns, kRows));
    EXPECT_NEAR(sum, 1, 1e-4);
}

TEST(FormulaEnvironment, MirrorAndConvolutionAreWeighted) {
    EXPECT_EQ(f::environmentReflect(dvec3(0.25), dvec3(0.5), dvec3(8), dvec3(2)), dvec3(3));
}

}  // namespace
}  // namespace umbriel
