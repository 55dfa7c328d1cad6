#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "shaders/formula_cpp.h"
#include "tests/numerics/furnace.h"
#include "tests/numerics/points.h"

// What glTF's material gives back in a white furnace.
namespace umbriel::numerics {
namespace {

namespace f = formula_f64;
using glm::dvec3;

f::MetallicRoughness material(double baseColour, double metallic, double roughness) {
    f::MetallicRoughness m;
    m.baseColour = dvec3(baseColour);
    m.metallic = metallic;
    m.roughness = roughness;
    return m;
}

double furnaceOverHalfVectors(const f::MetallicRoughness& m, dvec3 toEye) {
    return numerics::furnaceOverHalfVectors(
        [&](dvec3 toLight) { return f::metallicRoughnessReflect(m, dvec3(0, 0, 1), toLight, toEye).x; }, toEye,
        f::alphaFromRoughness(m.roughness));
}

TEST(FormulaEnergy, LambertGivesBackItsAlbedo) {
    EXPECT_NEAR(furnaceOverLights([](dvec3) { return f::lambertBrdf(dvec3(0.7)).x; }), 0.7, 1e-12);
    EXPECT_NEAR(furnaceOverLights([](dvec3) { return f::lambertBrdf(dvec3(1)).x; }), 1, 1e-11);
}

TEST(FormulaEnergy, WhiteMetalNeverGivesBackMoreThanItGets) {
    double most = 0;
    for (const double roughness : {0.0, 0.045, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0})
        for (const double cosEye : {1.0, 0.9, 0.5, 0.2, 0.05, 0.01, 1e-3}) {
            const double back = furnaceOverHalfVectors(material(1, 1, roughness), spherical(cosEye, 0));
            EXPECT_LE(back, 1 + 1e-3) << roughness << " " << cosEye;
            most = std::max(most, back);
        }
    RecordProperty("most", std::to_string(most));
}

TEST(FormulaEnergy, SmoothWhiteMetalGivesBackAll) {
    // Single scattering loses nothing when the surface is smooth.
    EXPECT_NEAR(furnaceOverHalfVectors(material(1, 1, 0.045), spherical(1.0, 0)), 1, 1e-3);
    EXPECT_NEAR(furnaceOverHalfVectors(material(1, 1, 0.045), spherical(0.5, 0)), 1, 1e-3);
}

TEST(FormulaEnergy, RoughWhiteMetalLosesWhatScatteredTwice) {
    // alpha = 1, seen straight on: f (n.l) = (n.l) / (2 pi ((n.l) + 1)), so the whole is the integral over c in [0, 1]
    // of c / (c + 1) = 1 - ln 2.
    const auto m = material(1, 1, 1);
    const dvec3 up(0, 0, 1);
    EXPECT_NEAR(furnaceOverHalfVectors(m, up), 1 - std::numbers::ln2, 2e-3);
    EXPECT_NEAR(furnaceOverLights([&](dvec3 l) { return f::metallicRoughnessReflect(m, up, l, up).x / l.z; }),
                1 - std::numbers::ln2, 1e-4);
}

// glTF adds its diffuse part without asking what the coat took under this angle. We draw what glTF says, and know where
// it gives too much.
TEST(FormulaEnergy, WhiteDielectricGivesTooMuchAtGrazingAnglesOnly) {
    const auto whole = [](double roughness, double cosEye) {
        const dvec3 eye = spherical(cosEye, 0);
        // The coat alone (black base) has the peak; the rest is even enough for the other integral.
        const double coat = furnaceOverHalfVectors(material(0, 0, roughness), eye);
        const double rest = furnaceOverLights([&](dvec3 l) {
            const dvec3 up(0, 0, 1);
            return (f::metallicRoughnessReflect(material(1, 0, roughness), up, l, eye).x -
                    f::metallicRoughnessReflect(material(0, 0, roughness), up, l, eye).x) /
                   l.z;
        });
        return coat + rest;
    };
    for (const double roughness : {0.045, 0.3, 0.6, 1.0}) {
        EXPECT_LE(whole(roughness, 1.0), 1 + 1e-3) << roughness;
        EXPECT_LE(whole(roughness, 0.01), 2) << roughness;
    }
    EXPECT_GT(whole(0.045, 0.05), 1.2);
    RecordProperty("smooth_at_87_degrees", std::to_string(whole(0.045, 0.05)));
    RecordProperty("smooth_at_60_degrees", std::to_string(whole(0.045, 0.5)));
    RecordProperty("rough_at_60_degrees", std::to_string(whole(1.0, 0.5)));
}

TEST(FormulaEnergy, LightAndEyeMayBeExchanged) {
    double worst = 0;
    for (const UnitReflectionPoint& at : reciprocityPoints(10000, 7)) {
        const auto& [p, n, l, v, cosLight, cosEye] = at;
        f::MetallicRoughness m = material(0, p.metallic, p.roughness);
        m.baseColour = dvec3(p.colour);
        const dvec3 there = f::metallicRoughnessReflect(m, n, l, v) / cosLight;
        const dvec3 back = f::metallicRoughnessReflect(m, n, v, l) / cosEye;
        const double unit = 0x1p-53 * sensitivity(p, f::alphaFromRoughness(p.roughness));
        for (int i = 0; i < 3; ++i) worst = std::max(worst, std::abs(there[i] - back[i]) / (there[i] * unit));
    }
    EXPECT_LT(worst, 6.0) << "roundings";
}

}  // namespace
}  // namespace umbriel::numerics
