#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "shaders/formula_cpp.h"

// Models of reflection against values known on paper.
namespace umbriel {
namespace {

namespace f = formula_f64;
using glm::dvec3;

constexpr double kPi = std::numbers::pi;

// In the xz plane, degrees from the normal.
dvec3 at(double degrees) {
    const double a = degrees * kPi / 180;
    return {std::sin(a), 0, std::cos(a)};
}
double cosine(double degrees) {
    return std::cos(degrees * kPi / 180);
}
const dvec3 kUp(0, 0, 1);

TEST(FormulaReflectionValues, MirroredDirectionIsOnTheOtherSide) {
    EXPECT_NEAR(glm::distance(f::mirrorDirection(kUp, at(35)), at(-35)), 0, 1e-15);
    EXPECT_EQ(f::mirrorDirection(kUp, kUp), kUp);
}

TEST(FormulaReflectionValues, PhongIsThePowerOfTheMirroredAngle) {
    // The eye 30 degrees from the mirrored light: cos^2 = 3/4.
    EXPECT_NEAR(f::phongHighlight(kUp, at(40), at(-10), 2), 0.75, 1e-15);
    EXPECT_NEAR(f::phongHighlight(kUp, at(40), at(-10), 4), 0.5625, 1e-15);
    EXPECT_EQ(f::phongHighlight(kUp, at(40), at(80), 4), 0) << "more than 90 degrees";
    EXPECT_EQ(f::phongHighlight(kUp, at(40), at(80), 0), 1) << "exponent 0";
}

TEST(FormulaReflectionValues, OnlyTheGateStopsALightBehindTheSurface) {
    EXPECT_NEAR(f::phongHighlight(kUp, at(100), at(-80), 2), cosine(20) * cosine(20), 1e-15);
    EXPECT_EQ(f::phongHighlightGated(kUp, at(100), at(-80), 2), 0);
    EXPECT_EQ(f::phongHighlightGated(kUp, dvec3(1, 0, 0), at(-80), 2), 0)
        << "strict: light in the plane of the surface";
    EXPECT_EQ(f::phongHighlightGated(kUp, at(60), at(-40), 2), f::phongHighlight(kUp, at(60), at(-40), 2));
    EXPECT_EQ(f::schlickHighlight(kUp, at(100), at(-80), 2), 0);
}

TEST(FormulaReflectionValues, SchlicksSubstituteIsItsQuotient) {
    // t = 1/2, s = 3: (1/2) / (3 - 3/2 + 1/2).
    EXPECT_NEAR(f::schlickPower(0.5, 0.75, 3), 0.25, 1e-15);
    EXPECT_DOUBLE_EQ(f::schlickPower(0.3, 1 - 0.09, 1), 0.3) << "exponent 1 is the cosine itself";
    EXPECT_EQ(f::schlickPower(1, 0, 50), 1);
    EXPECT_EQ(f::schlickPower(0, 1, 50), 0);
    EXPECT_EQ(f::schlickPower(0, 1, 0), 1) << "as the power it stands for";
    // The slope at t = 1 is s, as the power's.
    const double h = 1e-6;
    EXPECT_NEAR((1 - f::schlickPower(1 - h, 2 * h - h * h, 20)) / h, 20, 1e-2);
    EXPECT_EQ(f::schlickHighlight(kUp, dvec3(1, 0, 0), at(30), 3), 0) << "light in the plane of the surface";
    EXPECT_NEAR(f::schlickHighlight(kUp, at(80), at(40), 3), 0.25, 1e-14) << "half vector at 60 degrees";
    EXPECT_EQ(f::schlickHighlight(kUp, at(40), -at(40), 3), 0) << "light and eye opposite";
}

TEST(FormulaReflectionValues, NormalisedPhongHasItsPeak) {
    EXPECT_NEAR(f::normalisedPhongReflect(dvec3(1), 10, kUp, kUp, kUp).x, 12 / (2 * kPi), 1e-15);
    EXPECT_NEAR(f::normalisedPhongReflect(dvec3(0.5), 2, kUp, at(40), at(-10)).x,
                0.5 * 4 / (2 * kPi) * 0.75 * cosine(40), 1e-15);
    EXPECT_EQ(f::normalisedPhongReflect(dvec3(1), 2, kUp, at(40), at(-95)).x, 0);
    // Exponent 0 is an even lobe: 1/pi.
    EXPECT_NEAR(f::normalisedPhongReflect(dvec3(1), 0, kUp, kUp, at(70)).x, 1 / kPi, 1e-15);
}

TEST(FormulaReflectionValues, PhongsBrdfDividesByTheLightsCosineAndIsNotReciprocal) {
    const dvec3 light = at(60);
    const dvec3 eye = at(-30);
    const double there = f::nonReciprocalPhongBrdf(dvec3(0.5), 2, kUp, light, eye).x;
    EXPECT_NEAR(there, 0.5 * 0.75 / 0.5, 1e-14);
    const double back = f::nonReciprocalPhongBrdf(dvec3(0.5), 2, kUp, eye, light).x;
    EXPECT_NEAR(there / back, cosine(30) / cosine(60), 1e-14);
    EXPECT_NEAR(f::nonReciprocalPhongReflect(dvec3(0.5), 2, kUp, light, eye).x, there * cosine(60), 1e-15);
    // Unbounded at grazing, up to the guard.
    EXPECT_NEAR(f::nonReciprocalPhongBrdf(dvec3(1), 1, kUp, at(89.9999), at(-89.9999)).x, 1e4, 1e-2);
}

TEST(FormulaReflectionValues, PhongsOriginalCombinationIsItsFormula) {
    f::PhongOriginal m;
    m.colour = dvec3(0.8);
    m.ambient = 0.25;
    m.specular = dvec3(0.5);
    m.shininess = 2;
    EXPECT_NEAR(f::phongOriginal(m, kUp, at(60), at(-30)).x, 0.8 * (0.5 * 0.75 + 0.25) + 0.5 * 0.75, 1e-15);
    // Turned away: only the share that needs no light; 5.12 has no gate, so the eye is put where no highlight is.
    EXPECT_NEAR(f::phongOriginal(m, kUp, at(120), at(60)).x, 0.8 * 0.25, 1e-15);
}

f::ClassicMaterial classic() {
    f::ClassicMaterial m;
    m.ambient = dvec3(0.1);
    m.diffuse = dvec3(0.6);
    m.specular = dvec3(0.3);
    m.shininess = 4;
    return m;
}

TEST(FormulaReflectionValues, GeneralSumAddsItsThreeParts) {
    EXPECT_NEAR(f::generalSumTerm(classic(), dvec3(0.5), dvec3(2), dvec3(3), kUp, at(60), at(-30)).x,
                0.1 * 0.5 + 0.5 * 0.6 * 2 + 0.5625 * 0.3 * 3, 1e-15);
    EXPECT_EQ(f::ambientReflect(dvec3(0.5), dvec3(0.5)).x, 0.25);
    EXPECT_NEAR(f::diffuseReflect(dvec3(0.5), dvec3(2), kUp, at(60)).x, 0.5, 1e-15);
    EXPECT_EQ(f::diffuseReflect(dvec3(0.5), dvec3(2), kUp, at(100)).x, 0);
}

TEST(FormulaReflectionValues, OpenGlSumIsItsFormula) {
    // Half vector at 30 degrees: cos^4 = 9/16.
    const dvec3 term = f::openGlSumTerm(classic(), dvec3(0.5), dvec3(2), 0.25, kUp, at(60), at(0));
    EXPECT_NEAR(term.x, 0.25 * (0.1 * 0.5 + 0.5 * 0.6 * 2 + 0.5625 * 0.3 * 2), 1e-15);
    EXPECT_NEAR(f::openGlSumTerm(classic(), dvec3(0.5), dvec3(2), 0.25, kUp, at(120), at(0)).x, 0.25 * 0.1 * 0.5, 1e-15)
        << "a light behind the surface is ambient only";
    EXPECT_NEAR(f::openGlSum(dvec3(0.2), dvec3(0.5), dvec3(0.75), dvec3(0.1), dvec3(2), dvec3(1.5)).x,
                0.2 * 0.5 + 0.75 * (0.1 * 2 + 1.5), 1e-15);
}

TEST(FormulaReflectionValues, OpenGlSumIsBlinnPhongInOtherUnits) {
    f::BlinnPhong physical;
    physical.diffuse = dvec3(0.6);
    physical.specular = dvec3(0.3);
    physical.shininess = 4;
    const double irradiance = 5;
    const dvec3 seen = f::blinnPhongReflect(physical, kUp, at(50), at(-20)) * irradiance;
    const dvec3 summed = f::openGlSumTerm(classic(), dvec3(0), dvec3(irradiance / kPi), 1, kUp, at(50), at(-20));
    EXPECT_NEAR(seen.x, summed.x, 1e-15);
}

TEST(FormulaReflectionValues, MirroringLafortuneLobeIsNormalisedPhong) {
    f::LafortuneLobe lobe;
    lobe.albedo = f::lafortuneMirrorAlbedo(dvec3(0.7), 20);
    lobe.axes = dvec3(-1, -1, 1);
    lobe.exponent = 20;
    EXPECT_NEAR(f::lafortuneLobe(lobe, at(50), at(-30)).x * cosine(50),
                f::normalisedPhongReflect(dvec3(0.7), 20, kUp, at(50), at(-30)).x, 1e-15);
}

TEST(FormulaReflectionValues, LafortuneLobesPointWhereTheirAxesSay) {
    f::LafortuneLobe retro;
    retro.albedo = dvec3(0.4);
    retro.axes = dvec3(1, 1, 1);
    retro.exponent = 6;
    EXPECT_NEAR(f::lafortuneLobe(retro, at(50), at(50)).x, 0.4, 1e-15);
    EXPECT_NEAR(f::lafortuneLobe(retro, at(50), at(-10)).x, 0.4 * std::pow(0.5, 6), 1e-15);
    retro.axes = dvec3(0, 0, 1);
    EXPECT_NEAR(f::lafortuneLobe(retro, at(60), at(60)).x, 0.4 * std::pow(0.25, 6), 1e-15);
    retro.axes = dvec3(0, 0, 2);
    retro.exponent = 3;
    EXPECT_NEAR(f::lafortuneLobe(retro, kUp, kUp).x, 0.4 * 8, 1e-14) << "sums beyond 1 are allowed";
    EXPECT_EQ(f::lafortuneLobe(retro, at(91), kUp).x, 0);
    EXPECT_EQ(f::lafortuneLobe(retro, kUp, at(91)).x, 0);
    // Where the sum itself would not say so: a mirroring lobe reaches below the surface.
    retro.axes = dvec3(-1, -1, 1);
    EXPECT_EQ(f::lafortuneLobe(retro, at(60), at(-91)).x, 0);
    EXPECT_EQ(f::lafortuneLobe(retro, at(-91), at(60)).x, 0);
    EXPECT_NEAR(f::unboundedPower(2, 10), 1024, 1e-10);
    EXPECT_NEAR(formula_f32::unboundedPower(2, 1e4f) / 5.54e34f, 1, 1e-3) << "held within float";
    EXPECT_EQ(f::unboundedPower(0, 0), 1);
    EXPECT_EQ(f::unboundedPower(-1, 3), 0);
    const dvec3 local = f::localFromFrame(dvec3(1, 2, 3), dvec3(0, 1, 0), dvec3(-1, 0, 0), dvec3(0, 0, 1));
    EXPECT_EQ(local, dvec3(2, -1, 3));
}

// With l = v = n: D V = 1 / (4 pi alpha^2), and the coat takes nothing but f0 from the base.
TEST(FormulaReflectionValues, TorranceSparrowStraightOnHasItsClosedForm) {
    f::TorranceSparrow m;
    m.diffuse = dvec3(0.5);
    m.reflectance = dvec3(0.04);
    m.roughness = 0.5;
    const double alpha = 0.25;
    EXPECT_NEAR(f::torranceSparrowReflect(m, kUp, kUp, kUp).x,
                0.04 / (4 * kPi * alpha * alpha) + 0.5 * 0.96 / (kPi * (1 - f::coatShareMean(0.5))), 1e-15);
    EXPECT_NEAR(f::coatShareMean(0.5), 8.0 / 99 / (1 + 0.25 * (6.5 + 12 * 0.25)), 1e-15);
    EXPECT_EQ(f::torranceSparrowReflect(m, kUp, at(91), kUp).x, 0);
    EXPECT_EQ(f::torranceSparrowReflect(m, kUp, kUp, at(91)).x, 0);
    EXPECT_EQ(f::coatShare(1, 0.5), 0);
    EXPECT_NEAR(f::coatShare(0, 0), 1, 0.02) << "at grazing a smooth coat takes nearly all";
    EXPECT_NEAR(f::coatShare(0.5, 0), std::pow(0.5, 5), 0.01) << "a mirror's Fresnel term";
}

TEST(FormulaReflectionValues, TorranceSparrowOfAMetalIsThatOfGltf) {
    f::MetallicRoughness m;
    m.baseColour = dvec3(0.9, 0.6, 0.3);
    m.metallic = 1;
    m.roughness = 0.3;
    const dvec3 a = f::torranceSparrowReflect(f::torranceSparrowFrom(m), kUp, at(50), at(-30));
    const dvec3 b = f::metallicRoughnessReflect(m, kUp, at(50), at(-30));
    EXPECT_NEAR(glm::distance(a, b), 0, 1e-15);
}

}  // namespace
}  // namespace umbriel
