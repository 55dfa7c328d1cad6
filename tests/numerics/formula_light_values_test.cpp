#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/math/photometric_web.h"
#include "shaders/formula_cpp.h"
#include "tests/numerics/points.h"

// Lights, fog and photometric webs against values known on paper.
namespace umbriel {
namespace {

namespace f = formula_f64;
using glm::dvec3;

constexpr double kPi = std::numbers::pi;

dvec3 downTilted(double degrees) {
    const double a = degrees * kPi / 180;
    return {std::sin(a), 0, -std::cos(a)};
}
const dvec3 kDown(0, 0, -1);

TEST(FormulaLightValues, AttenuationIsTheReciprocalPolynomialUpToOne) {
    EXPECT_DOUBLE_EQ(f::artistAttenuation(2, dvec3(1, 0.5, 0.25)), 1.0 / 3);
    EXPECT_DOUBLE_EQ(f::artistAttenuation(3, dvec3(0, 0, 1)), 1.0 / 9);
    EXPECT_DOUBLE_EQ(f::artistAttenuation(0.5, dvec3(0, 0, 1)), 1) << "never brighter than the light";
    EXPECT_DOUBLE_EQ(f::artistAttenuation(100, dvec3(0.5, 0, 0)), 1);
    EXPECT_EQ(f::artistAttenuation(5, dvec3(0)), 1) << "no coefficients: no attenuation";
    EXPECT_EQ(f::artistAttenuation(0, dvec3(0, 1, 1)), 1);
    EXPECT_FLOAT_EQ(formula_f32::artistAttenuation(1e19f, glm::vec3(0, 0, 1)), 1e-37f);
    EXPECT_FLOAT_EQ(formula_f32::artistAttenuation(1e19f, glm::vec3(0, 0, 16)), 1e-37f) << "the square overflows";
}

TEST(FormulaLightValues, NoAttenuationGrowsWithDistance) {
    numerics::Sequence sequence(21);
    for (int i = 0; i < 300; ++i) {
        glm::vec3 k;
        for (int j = 0; j < 3; ++j) k[j] = sequence.unit() < 0.3f ? 0.0f : std::exp2(sequence.between(-20, 20));
        const float density = std::exp2(sequence.between(-20, 20));
        const float end = std::exp2(sequence.between(-10, 30));
        const glm::vec3 axis = sequence.direction();
        const glm::vec3 direction = sequence.directionAbout(axis);
        float last[6] = {1, 1, 1, 1, 1e4f, 1};
        for (float d = 0; d < 1.2e19f; d = d * 1.3f + 1e-6f) {
            const float now[6] = {formula_f32::artistAttenuation(d, k),
                                  formula_f32::fogExponential(d, density),
                                  formula_f32::fogSquaredExponential(d, density),
                                  formula_f32::fogLinear(d, end / 2, end),
                                  formula_f32::inverseSquare(d * d),
                                  formula_f32::spotClampedProduct(direction, axis, 4, d, k)};
            for (int j = 0; j < 6; ++j) {
                ASSERT_LE(now[j], last[j]) << "curve " << j << " at " << d;
                ASSERT_GE(now[j], 0) << "curve " << j << " at " << d;
                last[j] = now[j];
            }
        }
    }
}

TEST(FormulaLightValues, SpotIsThePowerOfTheCosine) {
    EXPECT_NEAR(f::spotPower(downTilted(60), kDown, 2), 0.25, 1e-15);
    EXPECT_NEAR(f::spotPower(downTilted(60), kDown, 1), 0.5, 1e-15);
    EXPECT_EQ(f::spotPower(kDown, kDown, 1e6), 1);
    EXPECT_EQ(f::spotPower(downTilted(120), kDown, 3), 0);
    EXPECT_EQ(f::spotPower(downTilted(180), kDown, 0), 1) << "exponent 0 is even, behind it too";
    // cos^1e6 of a thousandth: exp(-1e6 * 1e-6 / 2).
    EXPECT_NEAR(formula_f32::spotPower(glm::vec3(1e-3f, 0, -1), glm::vec3(0, 0, -1), 1e6f), std::exp(-0.5), 1e-5);
}

TEST(FormulaLightValues, ConeCutsTheSpot) {
    const double cone = std::cos(kPi / 4);
    EXPECT_NEAR(f::spotCone(downTilted(44), kDown, cone, 2), std::pow(std::cos(44 * kPi / 180), 2), 1e-15);
    EXPECT_EQ(f::spotCone(downTilted(46), kDown, cone, 2), 0);
    EXPECT_EQ(f::spotCone(kDown, kDown, 1, 8), 1) << "a cone without width keeps its axis";
    EXPECT_EQ(f::spotCone(downTilted(0.1), kDown, 1, 8), 0);
    EXPECT_EQ(f::spotCone(downTilted(180), kDown, -1, 0), 1) << "a full cone with exponent 0 is no spot at all";
}

TEST(FormulaLightValues, ClampedProductMayBeBrighterThanItsFactors) {
    const dvec3 k(0.5, 0, 0);
    EXPECT_NEAR(f::spotClampedProduct(downTilted(60), kDown, 2, 7, k), 0.5, 1e-15);
    EXPECT_NEAR(f::spotPower(downTilted(60), kDown, 2) * f::artistAttenuation(7, k), 0.25, 1e-15);
    EXPECT_EQ(f::spotClampedProduct(downTilted(60), kDown, 2, 7, dvec3(0.1, 0, 0)), 1);
    EXPECT_NEAR(f::spotClampedProduct(downTilted(60), kDown, 1, 2, dvec3(1, 0, 1)), 0.1, 1e-15);
    EXPECT_EQ(f::spotClampedProduct(downTilted(60), kDown, 2, 7, dvec3(0)), 1);
    EXPECT_EQ(f::spotClampedProduct(downTilted(120), kDown, 2, 7, dvec3(0)), 0);
}

TEST(FormulaLightValues, FogHasItsFourCurves) {
    EXPECT_DOUBLE_EQ(f::fogLinear(15, 10, 20), 0.5);
    EXPECT_DOUBLE_EQ(f::fogQuadratic(15, 10, 20), 0.25);
    EXPECT_DOUBLE_EQ(f::fogQuadratic(12.5, 10, 20), 0.5625);
    EXPECT_EQ(f::fogLinear(9, 10, 20), 1);
    EXPECT_EQ(f::fogLinear(21, 10, 20), 0);
    EXPECT_EQ(f::fogLinear(9.99, 10, 10), 1) << "start = end is a step";
    EXPECT_EQ(f::fogLinear(10, 10, 10), 0);
    EXPECT_NEAR(f::fogExponential(20, 0.05), std::exp(-1.0), 1e-15);
    EXPECT_NEAR(f::fogSquaredExponential(20, 0.025), std::exp(-0.25), 1e-15);
    EXPECT_EQ(f::fogExponential(1e19, 0), 1);
    EXPECT_EQ(formula_f32::fogExponential(1e19f, 1e19f), 0.0f);
    EXPECT_EQ(formula_f32::fogSquaredExponential(1e19f, 1e19f), 0.0f);
    EXPECT_EQ(f::fogMixed(dvec3(1, 2, 4), dvec3(3, 2, 0), 0.25), dvec3(2.5, 2, 1));
    EXPECT_EQ(formula_f32::fogMixed(glm::vec3(1), glm::vec3(1e30f), 1.0f), glm::vec3(1)) << "no fog takes no digits";
}

TEST(FormulaLightValues, AnglesAreThoseOfTheLibrary) {
    numerics::Sequence sequence(22);
    for (int i = 0; i < 100000; ++i) {
        const float y = sequence.between(-1, 1) * std::exp2(sequence.between(-30, 30));
        const float x = sequence.between(-1, 1) * std::exp2(sequence.between(-30, 30));
        const double exact = std::atan2(static_cast<double>(y), static_cast<double>(x));
        ASSERT_NEAR(f::angleOf(y, x), exact, 1e-15 * std::abs(exact)) << y << " " << x;
        ASSERT_NEAR(formula_f32::angleOf(y, x), exact, 4e-7 * std::abs(exact)) << y << " " << x;
    }
    EXPECT_EQ(f::angleOf(0, 0), 0);
    EXPECT_EQ(f::angleOf(0, 1), 0);
    EXPECT_DOUBLE_EQ(f::angleOf(0, -1), kPi);
    EXPECT_DOUBLE_EQ(f::angleOf(-1, 0), -kPi / 2);
    EXPECT_NEAR(f::angleBetween(downTilted(1e-7), kDown), 1e-7 * kPi / 180, 1e-22);
    EXPECT_NEAR(f::angleBetween(downTilted(180 - 1e-7), kDown), kPi - 1e-7 * kPi / 180, 1e-15);
}

TEST(FormulaLightValues, WebAnglesAreThoseOfTypeC) {
    EXPECT_EQ(f::webGamma(kDown), 0);
    EXPECT_DOUBLE_EQ(f::webGamma(dvec3(0, 0, 5)), kPi);
    EXPECT_DOUBLE_EQ(f::webGamma(dvec3(3, 0, 0)), kPi / 2);
    EXPECT_EQ(f::webPlane(dvec3(1, 0, -1)), 0);
    EXPECT_DOUBLE_EQ(f::webPlane(dvec3(0, 1, -1)), kPi / 2);
    EXPECT_DOUBLE_EQ(f::webPlane(dvec3(0, -2, 0)), 3 * kPi / 2);
    EXPECT_EQ(f::webGamma(dvec3(0)), 0);
    EXPECT_EQ(f::webPlane(dvec3(0)), 0);
}

TEST(FormulaLightValues, WebPlaceIsBetweenFourEntries) {
    // Four planes, three rows: 0, 90 and 180 degrees.
    f::WebPlace p = f::webPlace(dvec3(1, 1, -std::sqrt(2.0)), 4, 3);
    EXPECT_EQ(p.column0, 0);
    EXPECT_EQ(p.column1, 1);
    EXPECT_NEAR(p.across, 0.5, 1e-15);
    EXPECT_EQ(p.row0, 0);
    EXPECT_EQ(p.row1, 1);
    EXPECT_NEAR(p.down, 0.5, 1e-15);
    p = f::webPlace(dvec3(1, -1, 0), 4, 3);
    EXPECT_EQ(p.column0, 3);
    EXPECT_EQ(p.column1, 0) << "the last plane is followed by the first";
    EXPECT_NEAR(p.across, 0.5, 1e-15);
    EXPECT_EQ(p.row0 + p.down, 1);
    p = f::webPlace(dvec3(0, 0, 1), 4, 3);
    EXPECT_EQ(p.row1, 2);
    EXPECT_EQ(p.down, 1);
    p = f::webPlace(dvec3(-1, 0.5, 0), 1, 2);
    EXPECT_EQ(p.column0, 0);
    EXPECT_EQ(p.column1, 0) << "a rotationally symmetric light has one plane";
}

// What the importer's own table says, which finds its place by bisection and the library's atan2.
TEST(FormulaLightValues, WebIsReadAsTheImporterReadsIt) {
    constexpr int kColumns = 24;
    constexpr int kRows = 19;
    numerics::Sequence sequence(24);
    PhotometricWeb web;
    for (int j = 0; j < kRows; ++j) web.vertical.push_back(j + 1 == kRows ? kPi : j * kPi / (kRows - 1));
    for (int i = 0; i <= kColumns; ++i) web.horizontal.push_back(i * 2 * kPi / kColumns);
    for (int i = 0; i < kColumns * kRows; ++i) web.candela.push_back(1000 * sequence.unit());
    for (int j = 0; j < kRows; ++j) web.candela.push_back(web.candela[static_cast<size_t>(j)]);
    const auto entry = [&](int column, int row) -> double {
        return web.at(static_cast<size_t>(column), static_cast<size_t>(row));
    };
    for (int i = 0; i < 20000; ++i) {
        const dvec3 d(sequence.direction());
        const f::WebPlace p = f::webPlace(d, kColumns, kRows);
        ASSERT_NEAR(f::webIntensity(entry(p.column0, p.row0), entry(p.column1, p.row0), entry(p.column0, p.row1),
                                    entry(p.column1, p.row1), p.across, p.down),
                    web.intensityTowards(d), 1e-10);
    }
}

TEST(FormulaLightValues, WebIndicesStayInsideTheTable) {
    numerics::Sequence sequence(23);
    for (int i = 0; i < 20000; ++i) {
        const int columns = 1 + static_cast<int>(sequence.unit() * 4096);
        const int rows = 2 + static_cast<int>(sequence.unit() * 4095);
        const glm::vec3 axes[3] = {sequence.direction(), {1, -1e-20f, 0}, {1e-30f, -1e-30f, 1}};
        for (const glm::vec3 d : axes) {
            const auto p = formula_f32::webPlace(d, columns, rows);
            ASSERT_TRUE(p.column0 >= 0 && p.column0 < columns && p.column1 >= 0 && p.column1 < columns);
            ASSERT_TRUE(p.row0 >= 0 && p.row1 < rows && p.row1 == p.row0 + 1);
            ASSERT_TRUE(p.across >= 0 && p.across <= 1 && p.down >= 0 && p.down <= 1);
        }
    }
}

TEST(FormulaLightValues, TablesAreReadBilinearly) {
    EXPECT_DOUBLE_EQ(f::webIntensity(1, 3, 5, 11, 0.5, 0.5), 5);
    EXPECT_DOUBLE_EQ(f::webIntensity(1, 3, 5, 11, 1, 0), 3);
    EXPECT_DOUBLE_EQ(f::webIntensity(1, 3, 5, 11, 0, 1), 5);
    EXPECT_DOUBLE_EQ(f::tableFraction(1, 3, 1.5), 0.25);
    EXPECT_EQ(f::tableFraction(1, 3, 4), 1);
    EXPECT_EQ(f::tableFraction(2, 2, 2), 0) << "an empty step";
}

// Ganster (4) to (8), by hand: 8 W/sr at 2 m under 60 degrees, r_diff 0.5: 0.5 * 8 / 4 * 0.5.
TEST(FormulaLightValues, GouraudsModelIsInRadiance) {
    const dvec3 up(0, 0, 1);
    const dvec3 toLight = -downTilted(60);
    const double g = f::geometryTermPoint(4, 1);
    EXPECT_DOUBLE_EQ(g, 0.25);
    EXPECT_NEAR(f::gouraudDiffuse(dvec3(0.5), g, dvec3(8), up, toLight).x, 0.5, 1e-15);
    // The eye 60 degrees from the mirrored light: straight up. cos^3 = 1/8.
    EXPECT_NEAR(f::gouraudSpecular(dvec3(0.5), 3, g, dvec3(8), up, toLight, up).x, 0.125, 1e-15);
    EXPECT_EQ(f::geometryTermPoint(4, 0), 0) << "in shadow";
    EXPECT_EQ(f::geometryTermDirectional(1), 1);
    EXPECT_EQ(f::gouraudDiffuse(dvec3(1), g, dvec3(8), up, -toLight).x, 0);
    EXPECT_DOUBLE_EQ(f::gouraudAmbient(dvec3(0.5), dvec3(3)).x, 1.5);
}

}  // namespace
}  // namespace umbriel
