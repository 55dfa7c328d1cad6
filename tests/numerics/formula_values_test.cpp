#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <type_traits>

#include "shaders/formula_cpp.h"
#include "shaders/structs_cpp.h"

// What the formulas are known to be, on paper.
namespace umbriel {
namespace {

namespace f = formula_f64;
using glm::dvec3;

constexpr double kPi = std::numbers::pi;

dvec3 atAngle(double radians) {
    return {std::sin(radians), 0, std::cos(radians)};
}
const dvec3 kUp(0, 0, 1);

f::MetallicRoughness material(dvec3 baseColour, double metallic, double roughness) {
    f::MetallicRoughness m;
    m.baseColour = baseColour;
    m.metallic = metallic;
    m.roughness = roughness;
    return m;
}

f::BlinnPhong blinnPhong(double diffuse, double specular, double shininess) {
    f::BlinnPhong m;
    m.diffuse = dvec3(diffuse);
    m.specular = dvec3(specular);
    m.shininess = shininess;
    return m;
}

TEST(FormulaValues, ConstantsAreThoseOfTheirPrecision) {
    EXPECT_EQ(formula_f32::kPi, std::numbers::pi_v<float>);
    EXPECT_EQ(formula_f64::kPi, std::numbers::pi);
    EXPECT_EQ(formula_f64::kInversePi, std::numbers::inv_pi);
    static_assert(std::is_same_v<decltype(formula_f32::saturate(0.0f)), float>);
    static_assert(std::is_same_v<decltype(formula_f64::saturate(0.0)), double>);
}

TEST(FormulaValues, LambertIsAlbedoOverPi) {
    EXPECT_DOUBLE_EQ(f::lambertBrdf(dvec3(0.5, 0, 1)).x, 0.5 / kPi);
    EXPECT_DOUBLE_EQ(f::lambertBrdf(dvec3(0.5, 0, 1)).y, 0);
}

TEST(FormulaValues, FresnelIsF0StraightOnAndOneAtGrazing) {
    EXPECT_NEAR(f::reflectanceFromIor(1.5), 0.04, 1e-15);
    EXPECT_DOUBLE_EQ(f::fresnelSchlick(dvec3(0.04), 1.0).x, 0.04);
    EXPECT_DOUBLE_EQ(f::fresnelSchlick(dvec3(0.04), 0.0).x, 1.0);
    EXPECT_DOUBLE_EQ(f::fresnelSchlick(dvec3(0.04), 0.5).x, 0.04 + 0.96 / 32);
    // A cosine beyond 1 by rounding must not turn the fifth power negative.
    EXPECT_DOUBLE_EQ(f::fresnelSchlick(dvec3(0.04), 1.0 + 1e-7).x, 0.04);
}

// With l = v = n: D = 1 / (pi alpha^2), V = 1/4, F = f0.
TEST(FormulaValues, MetalAtNormalIncidenceHasItsClosedForm) {
    for (const double roughness : {0.045, 0.1, 0.5, 1.0}) {
        const double alpha = roughness * roughness;
        const dvec3 seen = f::metallicRoughnessReflect(material(dvec3(0.8), 1, roughness), kUp, kUp, kUp);
        EXPECT_NEAR(seen.x, 0.8 / (4 * kPi * alpha * alpha), 1e-12 * seen.x) << roughness;
    }
}

TEST(FormulaValues, DielectricAtNormalIncidenceIsCoatPlusDiffuse) {
    const dvec3 seen = f::metallicRoughnessReflect(material(dvec3(0.5), 0, 1), kUp, kUp, kUp);
    EXPECT_NEAR(seen.x, 0.04 / (4 * kPi) + 0.96 * 0.5 / kPi, 1e-15);
}

// alpha = 1 is the one distribution without a peak: D = 1/pi everywhere, V = 1 / (2 (n.l + n.v)).
TEST(FormulaValues, RoughestMetalIsFlat) {
    const dvec3 seen = f::metallicRoughnessReflect(material(dvec3(1), 1, 1), kUp, atAngle(1.0), atAngle(-0.3));
    EXPECT_NEAR(seen.x, std::cos(1.0) / (2 * kPi * (std::cos(1.0) + std::cos(0.3))), 1e-15);
}

TEST(FormulaValues, NothingIsReflectedFromBehind) {
    const auto m = material(dvec3(1), 0.5, 0.3);
    EXPECT_EQ(f::metallicRoughnessReflect(m, kUp, atAngle(kPi / 2 + 0.01), kUp), dvec3(0));
    EXPECT_EQ(f::blinnPhongReflect(blinnPhong(1, 1, 8), kUp, atAngle(kPi / 2 + 0.01), kUp), dvec3(0));
    // The gate is strict: a light exactly in the plane of the surface gives nothing.
    EXPECT_EQ(f::blinnPhongReflect(blinnPhong(1, 1, 8), kUp, dvec3(1, 0, 0), kUp), dvec3(0));
}

TEST(FormulaValues, AmbientReflectsTheAlbedoAndOcclusionDimsIt) {
    EXPECT_NEAR(f::metallicRoughnessAmbient(material(dvec3(1), 0, 0.5), dvec3(2), 1).x, 2, 1e-15);
    EXPECT_NEAR(f::metallicRoughnessAmbient(material(dvec3(1), 1, 0.5), dvec3(2), 1).x, 2, 1e-15);
    EXPECT_NEAR(f::metallicRoughnessAmbient(material(dvec3(0), 0, 0.5), dvec3(1), 0.5).x, 0.02, 1e-15);
    EXPECT_DOUBLE_EQ(f::blinnPhongAmbient(dvec3(0.5), dvec3(4), 0.25).x, 0.5);
    EXPECT_DOUBLE_EQ(f::occlusionFactor(0.2, 0.0), 1);
    EXPECT_DOUBLE_EQ(f::occlusionFactor(0.2, 1.0), 0.2);
    EXPECT_DOUBLE_EQ(f::occlusionFactor(0.2, 0.5), 0.6);
}

TEST(FormulaValues, BlinnPhongIsThePowerOfTheHalfAngle) {
    // Half vector 30 degrees off the normal: cos^2 = 3/4, cos^4 = 9/16.
    const dvec3 toLight = atAngle(kPi / 6 + 0.4);
    const dvec3 toEye = atAngle(kPi / 6 - 0.4);
    EXPECT_NEAR(f::blinnPhongHighlight(kUp, toLight, toEye, 2), 0.75, 1e-15);
    EXPECT_NEAR(f::blinnPhongHighlight(kUp, toLight, toEye, 4), 0.5625, 1e-15);
    EXPECT_NEAR(f::blinnPhongHighlight(kUp, toLight, toEye, 0), 1, 0);
    EXPECT_NEAR(f::blinnPhongHighlight(kUp, kUp, kUp, 1e6), 1, 0);
    EXPECT_NEAR(f::blinnPhongReflect(blinnPhong(0.5, 0.25, 4), kUp, toLight, toEye).x,
                (0.5 * toLight.z + 0.25 * 0.5625) / kPi, 1e-15);
}

TEST(FormulaValues, OppositeLightAndEyeGiveNoHighlight) {
    const dvec3 toLight = atAngle(0.5);
    EXPECT_EQ(f::blinnPhongHighlight(kUp, toLight, -toLight, 8), 0);
    EXPECT_EQ(f::metallicRoughnessReflect(material(dvec3(1), 0, 0.5), kUp, toLight, -toLight), dvec3(0));
}

TEST(FormulaValues, PowersAreDefinedAtTheirEnds) {
    EXPECT_EQ(f::positivePower(0, 0), 1);
    EXPECT_EQ(f::positivePower(0, 2), 0);
    EXPECT_EQ(f::positivePower(-1e-8, 10), 0);
    EXPECT_EQ(f::positivePower(1, 1e6), 1);
    EXPECT_NEAR(f::positivePower(0.25, 0.5), 0.5, 1e-15);
    EXPECT_EQ(f::cosinePower(0, 1, 0), 1);
    EXPECT_EQ(f::cosinePower(0, 1, 3), 0);
}

// In float pow(1 - 2^-24, 1e6) has lost the angle; the sine has not.
TEST(FormulaValues, HugeExponentsKeepTheirDigits) {
    for (const double angle : {1e-5, 1e-4, 1e-3, 3e-3})
        for (const double exponent : {1e3, 1e5, 1e6}) {
            const double exact = std::exp(exponent * 0.5 * std::log1p(-std::sin(angle) * std::sin(angle)));
            if (exact < 1e-30) continue;
            const float cosine = static_cast<float>(std::cos(angle));
            const float sineSquared = static_cast<float>(std::sin(angle) * std::sin(angle));
            // The exponent's own value, up to 69 here, times three roundings of 6e-8.
            const double bound = 2e-7 * (1 - std::log(exact));
            EXPECT_NEAR(formula_f32::cosinePower(cosine, sineSquared, static_cast<float>(exponent)), exact,
                        bound * exact)
                << angle << " " << exponent;
        }
}

TEST(FormulaValues, IntensityFallsWithTheSquareUntilOneCentimetre) {
    EXPECT_DOUBLE_EQ(f::inverseSquare(4), 0.25);
    EXPECT_DOUBLE_EQ(f::inverseSquare(1e-4), 1e4);
    EXPECT_DOUBLE_EQ(f::inverseSquare(0), 1e4);
}

TEST(FormulaValues, RangeWindowIsThatOfKhrLightsPunctual) {
    EXPECT_DOUBLE_EQ(f::rangeWindow(0, 10), 1);
    EXPECT_DOUBLE_EQ(f::rangeWindow(25, 10), 1 - 1.0 / 16);
    EXPECT_DOUBLE_EQ(f::rangeWindow(100, 10), 0);
    EXPECT_DOUBLE_EQ(f::rangeWindow(1e38, 10), 0);
    EXPECT_DOUBLE_EQ(f::rangeWindow(1e38, 0), 1) << "no range is unlimited";
    EXPECT_EQ(formula_f32::rangeWindow(1e38f, 1e-20f), 0.0f);
    EXPECT_EQ(formula_f32::rangeWindow(1.0f, 1e25f), 1.0f);
}

TEST(FormulaValues, SpotGoesFromOneAtTheInnerAngleToZeroAtTheOuter) {
    const double inner = std::cos(0.3);
    const double outer = std::cos(0.6);
    const double scale = f::spotScale(inner, outer);
    EXPECT_NEAR(f::spotFactor(inner, outer, scale), 1, 1e-15);
    EXPECT_DOUBLE_EQ(f::spotFactor(outer, outer, scale), 0);
    EXPECT_NEAR(f::spotFactor((inner + outer) / 2, outer, scale), 0.25, 1e-15);
    EXPECT_DOUBLE_EQ(f::spotFactor(1, outer, scale), 1);
    EXPECT_DOUBLE_EQ(f::spotFactor(-1, outer, scale), 0);
}

TEST(FormulaValues, EqualSpotAnglesMakeANarrowEdge) {
    const double outer = std::cos(0.6);
    const double scale = f::spotScale(outer, outer);
    EXPECT_DOUBLE_EQ(f::spotFactor(outer, outer, scale), 0);
    EXPECT_NEAR(f::spotFactor(outer + 0.001, outer, scale), 1, 1e-12);
}

TEST(FormulaValues, DirectionToALightOnTheSurfaceIsNone) {
    double distanceSquared = -1;
    EXPECT_EQ(f::directionTo(dvec3(1, 2, 3), dvec3(1, 2, 3), distanceSquared), dvec3(0));
    EXPECT_EQ(distanceSquared, 0);
    EXPECT_EQ(f::directionTo(dvec3(1, 2, 5), dvec3(1, 2, 3), distanceSquared), dvec3(0, 0, 1));
    EXPECT_EQ(distanceSquared, 4);
}

TEST(FormulaValues, SrgbIsItsStandard) {
    EXPECT_EQ(f::linearFromSrgb(0), 0);
    EXPECT_EQ(f::linearFromSrgb(1), 1);
    EXPECT_NEAR(f::linearFromSrgb(0.5), 0.21404114048223255, 1e-14);
    EXPECT_NEAR(f::srgbFromLinear(0.18), 0.46135612950044164, 1e-14);
    for (int code = 0; code <= 255; ++code)
        EXPECT_NEAR(f::srgbFromLinear(f::linearFromSrgb(code / 255.0)) * 255, code, 1e-4);
    EXPECT_DOUBLE_EQ(f::luminance(dvec3(1)), 1);
    EXPECT_EQ(f::clampToHalf(1e30), 65504);
    EXPECT_EQ(f::clampToHalf(-1e30), -65504);
}

TEST(FormulaValues, FlatNormalMapLeavesTheNormal) {
    const dvec3 texel(0.5, 0.5, 1);
    const dvec3 n = f::mappedNormal(dvec3(0, 0, 3), dvec3(2, 0, 1), 1, f::normalFromTexel(texel, 1), kUp);
    EXPECT_NEAR(glm::distance(n, kUp), 0, 1e-15);
}

TEST(FormulaValues, NormalMapTiltsAlongTangentAndBitangent) {
    const double s = 0.6;
    // x of the texture is the tangent; y is cross(normal, tangent) times the handedness.
    EXPECT_NEAR(glm::distance(f::mappedNormal(kUp, dvec3(1, 0, 0), 1, dvec3(s, 0, 0.8), kUp), dvec3(s, 0, 0.8)), 0,
                1e-15);
    EXPECT_NEAR(glm::distance(f::mappedNormal(kUp, dvec3(1, 0, 0), 1, dvec3(0, s, 0.8), kUp), dvec3(0, s, 0.8)), 0,
                1e-15);
    EXPECT_NEAR(glm::distance(f::mappedNormal(kUp, dvec3(1, 0, 0), -1, dvec3(0, s, 0.8), kUp), dvec3(0, -s, 0.8)), 0,
                1e-15);
    EXPECT_EQ(f::normalFromTexel(dvec3(1, 0, 1), 0.5), dvec3(0.5, -0.5, 1));
}

TEST(FormulaValues, WithoutAFrameTheNormalStands) {
    const dvec3 mapped(0.6, 0, 0.8);
    EXPECT_EQ(f::mappedNormal(kUp, dvec3(0), 1, mapped, kUp), kUp);
    EXPECT_EQ(f::mappedNormal(kUp, dvec3(0, 0, 5), 1, mapped, kUp), kUp);
    EXPECT_EQ(f::mappedNormal(dvec3(0), dvec3(0), 1, mapped, dvec3(0, 1, 0)), dvec3(0, 1, 0));
}

TEST(FormulaValues, FrameAlongAnAxisKeepsLengthsAnglesAndHands) {
    for (const dvec3& axis : {dvec3(0, 0, 1), dvec3(0, 0, -1), dvec3(0.6, 0, 0.8), dvec3(0, -0.6, -0.8), dvec3(1, 0, 0),
                              glm::normalize(dvec3(1e-9, 1e-9, -1)), glm::normalize(dvec3(3, -2, 1e-12))}) {
        EXPECT_NEAR(glm::distance(f::inFrameAlong(axis, axis), dvec3(0, 0, 1)), 0, 1e-15);
        const dvec3 u(1, 2, 3), v(-2, 0.5, 1);
        const dvec3 inU = f::inFrameAlong(axis, u), inV = f::inFrameAlong(axis, v);
        EXPECT_NEAR(inU.z, glm::dot(axis, u), 1e-15);
        EXPECT_NEAR(glm::dot(inU, inU), 14, 1e-14);
        EXPECT_NEAR(glm::dot(inU, inV), glm::dot(u, v), 1e-14);
        EXPECT_NEAR(glm::distance(glm::cross(inU, inV), f::inFrameAlong(axis, glm::cross(u, v))), 0, 1e-14);
    }
}

TEST(FormulaValues, ShadowFilterIsBilinearOverComparisons) {
    EXPECT_EQ(f::shadowCompare(0.5, 0.5), 1);
    EXPECT_EQ(f::shadowCompare(0.5, 0.6), 0);
    EXPECT_DOUBLE_EQ(f::shadowMix2x2(1, 0, 0, 0, 0, 0), 1);
    EXPECT_DOUBLE_EQ(f::shadowMix2x2(0, 1, 0, 0, 0.25, 0), 0.25);
    EXPECT_DOUBLE_EQ(f::shadowMix2x2(0, 0, 1, 1, 0.3, 0.75), 0.75);
}

}  // namespace
}  // namespace umbriel
