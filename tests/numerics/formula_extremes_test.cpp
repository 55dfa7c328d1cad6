#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "shaders/formula_cpp.h"
#include "tests/numerics/points.h"

// The ends of every domain, in float: finite, ordered, and close to double.
namespace umbriel::numerics {
namespace {

namespace f32 = formula_f32;
namespace f64 = formula_f64;

constexpr float kUlpBelowOne = 1.0f - 0x1p-24f;
constexpr std::array kCosines{0.0f, 1e-8f, 1e-4f, 0.5f, kUlpBelowOne, 1.0f};
constexpr std::array kExponents{0.0f, 1e-3f, 1.0f, 1e3f, 1e4f, 1e6f};
constexpr std::array kRoughnesses{0.0f, 1e-4f, 0.045f, 0.5f, kUlpBelowOne, 1.0f};

bool isFinite(glm::vec3 v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

glm::vec3 tilted(float cosine, float azimuth) {
    const float sine = std::sqrt(1.0f - cosine * cosine);
    return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

f32::MetallicRoughness materialOf(const ReflectionPoint& p) {
    f32::MetallicRoughness m;
    m.baseColour = p.colour;
    m.metallic = p.metallic;
    m.roughness = p.roughness;
    return m;
}

f64::MetallicRoughness materialOf64(const ReflectionPoint& p) {
    f64::MetallicRoughness m;
    m.baseColour = glm::dvec3(p.colour);
    m.metallic = p.metallic;
    m.roughness = p.roughness;
    return m;
}

// Everything that a surface does with one light, for one pair of directions.
void expectFiniteReflection(glm::vec3 normal, glm::vec3 toLight, glm::vec3 toEye) {
    for (const float roughness : kRoughnesses)
        for (const float metallic : {0.0f, 1.0f}) {
            f32::MetallicRoughness m;
            m.baseColour = glm::vec3(1.0f, 0.5f, 0.0f);
            m.metallic = metallic;
            m.roughness = roughness;
            const glm::vec3 seen = f32::metallicRoughnessReflect(m, normal, toLight, toEye);
            EXPECT_TRUE(isFinite(seen) && seen.x >= 0 && seen.y >= 0 && seen.z >= 0)
                << roughness << " " << metallic << " n.l " << glm::dot(normal, toLight);
            EXPECT_TRUE(isFinite(seen * 1e30f)) << "radiance of 1e30 must survive";
        }
    for (const float exponent : kExponents) {
        const float highlight = f32::blinnPhongHighlight(normal, toLight, toEye, exponent);
        EXPECT_TRUE(highlight >= 0 && highlight <= 1) << exponent;
    }
}

TEST(FormulaExtremes, ReflectionIsFiniteAtEveryCornerOfTheDomain) {
    const glm::vec3 up(0, 0, 1);
    for (const float cosLight : kCosines)
        for (const float cosEye : kCosines)
            for (const float azimuth : {0.0f, 1.0f, 3.14159265f})
                expectFiniteReflection(up, tilted(cosLight, 0.0f), tilted(cosEye, azimuth));
}

TEST(FormulaExtremes, ReflectionIsFiniteAroundTheTerminator) {
    const glm::vec3 up(0, 0, 1);
    const float tiny = std::numeric_limits<float>::min();
    for (const float z : {-0x1p-24f, -tiny, 0.0f, std::numeric_limits<float>::denorm_min(), tiny, 0x1p-24f}) {
        expectFiniteReflection(up, {1, 0, z}, {0, 1, 0});
        expectFiniteReflection(up, {1, 0, z}, {-1, 0, z});
        expectFiniteReflection(up, {1, 0, z}, {-1, 0, -z});
        expectFiniteReflection(up, {1, 0, z}, {1, 0, -1});
    }
}

TEST(FormulaExtremes, ReflectionIsFiniteWithoutDirections) {
    const glm::vec3 none(0);
    const glm::vec3 up(0, 0, 1);
    expectFiniteReflection(none, up, up);
    expectFiniteReflection(up, none, up);
    expectFiniteReflection(up, up, none);
    expectFiniteReflection(up, up, -up);
    // Interpolated normals are shorter than 1.
    expectFiniteReflection(up * 0.1f, up, tilted(0.3f, 1.0f));
}

TEST(FormulaExtremes, NormalizingWorksFromTheSmallestToTheLargest) {
    const glm::vec3 fallback(0, 1, 0);
    for (int exponent = -126; exponent <= 125; ++exponent) {
        const float s = std::ldexp(1.0f, exponent);
        const glm::vec3 unit = f32::normalizeOr(glm::vec3(3 * s, 0, -4 * s) * 0.25f, fallback);
        if (exponent >= -125) {
            EXPECT_NEAR(unit.x, 0.6f, 1e-7f) << exponent;
            EXPECT_NEAR(unit.z, -0.8f, 1e-7f) << exponent;
        }
    }
    const float infinity = std::numeric_limits<float>::infinity();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const glm::vec3 v : {glm::vec3(0), glm::vec3(1e-40f), glm::vec3(infinity, 0, 0), glm::vec3(nan)})
        EXPECT_EQ(f32::normalizeOr(v, fallback), fallback);
}

TEST(FormulaExtremes, LightsAreFiniteAtEveryDistance) {
    for (const float distance : {0.0f, 1e-30f, 1e-8f, 1.0f, 1e9f, 1e19f}) {
        float distanceSquared = 0;
        const glm::vec3 toLight = f32::directionTo(glm::vec3(distance, 0, 0), glm::vec3(0), distanceSquared);
        EXPECT_TRUE(isFinite(toLight));
        for (const float range : {0.0f, 1e-30f, 1.0f, 1e30f}) {
            const float arriving = f32::inverseSquare(distanceSquared) * f32::rangeWindow(distanceSquared, range);
            EXPECT_TRUE(std::isfinite(arriving) && arriving >= 0) << distance << " " << range;
        }
    }
}

TEST(FormulaExtremes, SpotsAreFiniteForEveryConeAndNeverBrightenOutwards) {
    const float pi = 3.14159265f;
    for (const float outer : {0.0f, 1e-4f, 0.5f, pi / 2, pi})
        for (const float inner : {0.0f, outer / 2, outer}) {
            const float scale = f32::spotScale(std::cos(inner), std::cos(outer));
            float previous = 1;
            for (int i = 0; i <= 1000; ++i) {
                const float factor =
                    f32::spotFactor(std::cos(pi * static_cast<float>(i) / 1000), std::cos(outer), scale);
                EXPECT_TRUE(factor >= 0 && factor <= previous) << outer << " " << inner << " " << i;
                previous = factor;
            }
        }
}

TEST(FormulaExtremes, HighlightFallsMonotonicallyWithTheExponent) {
    for (const float cosine : kCosines) {
        float previous = 1;
        for (const float exponent : kExponents) {
            const float value = f32::cosinePower(cosine, 1 - cosine * cosine, exponent);
            EXPECT_LE(value, previous) << cosine << " " << exponent;
            previous = value;
        }
    }
}

// Float against double at the same points. The bound is the problem's own sensitivity times a few roundings.
TEST(FormulaExtremes, FloatMetallicRoughnessFollowsDouble) {
    double worst = 0;
    for (const ReflectionPoint& p : reflectionPoints(20000, 1)) {
        const glm::vec3 single = f32::metallicRoughnessReflect(materialOf(p), p.normal, p.toLight, p.toEye);
        const glm::dvec3 exact = f64::metallicRoughnessReflect(materialOf64(p), p.normal, p.toLight, p.toEye);
        if (glm::dot(glm::dvec3(p.normal), glm::dvec3(p.toLight)) < 1e-6) continue;  // either side of the gate
        const double unit = 0x1p-24 * sensitivity(p, f64::alphaFromRoughness(p.roughness));
        for (int i = 0; i < 3; ++i) worst = std::max(worst, std::abs(single[i] - exact[i]) / (exact[i] * unit));
    }
    EXPECT_LT(worst, 6.0) << "roundings";
    RecordProperty("worst_roundings", std::to_string(worst));
}

TEST(FormulaExtremes, FloatHighlightFollowsDouble) {
    double worst = 0;
    for (const ReflectionPoint& p : reflectionPoints(20000, 2)) {
        const double exact = f64::blinnPhongHighlight(p.normal, p.toLight, p.toEye, p.shininess);
        if (exact < 1e-30 || glm::dot(glm::dvec3(p.normal), glm::dvec3(p.toLight)) < 1e-6) continue;
        const double single = f32::blinnPhongHighlight(p.normal, p.toLight, p.toEye, p.shininess);
        // d(cos^s) / cos^s = s tan(a) da, and the exponent -log(value) carries its own rounding.
        const double sum = glm::length(glm::dvec3(p.toLight) + glm::dvec3(p.toEye));
        const double cosine =
            glm::dot(glm::dvec3(p.normal), glm::normalize(glm::dvec3(p.toLight) + glm::dvec3(p.toEye)));
        const double tangent = std::sqrt(std::max(0.0, 1 - cosine * cosine)) / cosine;
        const double unit = 0x1p-24 * (1 - std::log(exact) + p.shininess * tangent / sum);
        worst = std::max(worst, std::abs(single - exact) / (exact * unit));
    }
    // Beyond sin^2 = 1/16 the cosine itself is used: s roundings of it, where the unit counts s tan(a) >= s / 4.
    EXPECT_LT(worst, 12.0) << "roundings";
    RecordProperty("worst_roundings", std::to_string(worst));
}

TEST(FormulaExtremes, FloatLightAndColourFollowDouble) {
    Sequence sequence(3);
    double worst = 0;
    const auto compare = [&](double single, double exact, double unit) {
        worst = std::max(worst, std::abs(single - exact) / unit);
    };
    for (int i = 0; i < 20000; ++i) {
        const float distanceSquared = std::exp2(sequence.between(-20, 60));
        const float range = std::exp2(sequence.between(-10, 30));
        compare(f32::inverseSquare(distanceSquared), f64::inverseSquare(distanceSquared),
                0x1p-24 * f64::inverseSquare(distanceSquared));
        compare(f32::rangeWindow(distanceSquared, range), f64::rangeWindow(distanceSquared, range), 6 * 0x1p-24);
        const float cosOuter = sequence.between(-1, 1);
        const float cosInner = sequence.between(cosOuter, 1);
        const float cosine = sequence.between(-1, 1);
        const float scale = f32::spotScale(cosInner, cosOuter);
        compare(f32::spotFactor(cosine, cosOuter, scale), f64::spotFactor(cosine, cosOuter, scale), 4 * 0x1p-24);
        const float code = sequence.unit();
        compare(f32::linearFromSrgb(code), f64::linearFromSrgb(code), 8 * 0x1p-24);
        compare(f32::srgbFromLinear(code), f64::srgbFromLinear(code), 8 * 0x1p-24);
    }
    EXPECT_LE(worst, 1.0);
}

TEST(FormulaExtremes, MappedNormalsAreUnitAndFollowDouble) {
    Sequence sequence(4);
    for (int i = 0; i < 20000; ++i) {
        const glm::vec3 normal = sequence.direction() * std::exp2(sequence.between(-30, 30));
        const glm::vec3 tangent = sequence.direction() * std::exp2(sequence.between(-30, 30));
        const glm::vec3 texel(sequence.unit(), sequence.unit(), sequence.unit());
        const float sine = glm::length(glm::cross(glm::normalize(normal), glm::normalize(tangent)));
        const glm::vec3 single =
            f32::mappedNormal(normal, tangent, -1.0f, f32::normalFromTexel(texel, 0.7f), glm::vec3(0, 0, 1));
        const glm::dvec3 exact =
            f64::mappedNormal(normal, tangent, -1.0, f64::normalFromTexel(texel, 0.7f), glm::dvec3(0, 0, 1));
        const double mapped = glm::length(f64::normalFromTexel(texel, 0.7f));
        EXPECT_NEAR(glm::length(single), 1.0, 3e-7);
        // The frame's error grows as the tangent nears the normal, and the sum's as the mapped normal shrinks.
        EXPECT_LT(glm::distance(glm::dvec3(single), exact), 8 * 0x1p-24 * (1 / sine + 1 / mapped));
    }
}

// The biases against geometry: the stored depth of any texel in reach never lies before the receiver, moved towards the
// light.
TEST(FormulaExtremes, NormalOffsetIsEnoughAtEverySlopeAndNotMore) {
    Sequence sequence(5);
    for (int i = 0; i < 20000; ++i) {
        glm::dvec3 normal(sequence.direction());
        normal.z = -std::max(std::abs(normal.z), 2e-3);  // depth grows along +z, the surface faces the light
        normal = glm::normalize(normal);
        const double texel = std::exp2(sequence.between(-10, 10));
        const double offset = f64::shadowNormalOffset(normal, texel, 1.0);
        // Depth of the plane through the origin at (x, y): -(n.x x + n.y y) / n.z.
        const auto stored = [&](double x, double y) { return -(normal.x * x + normal.y * y) / normal.z; };
        const double moved = -f64::shadowOffsetToLight(offset, -normal.z);
        double slack = std::numeric_limits<double>::infinity();
        for (const double dx : {-texel, 0.0, texel})
            for (const double dy : {-texel, 0.0, texel}) slack = std::min(slack, stored(dx, dy) - moved);
        const double scale = texel / std::abs(normal.z);
        EXPECT_NEAR(slack, 0, 1e-12 * scale) << "the farthest corner decides";
    }
    // Edge-on and from behind: held, finite, never away from the light.
    for (const double cosine : {1e-3, 1e-9, 0.0, -0.0, -1.0})
        EXPECT_EQ(f64::shadowOffsetToLight(1.0, cosine), 1e3) << cosine;
}

}  // namespace
}  // namespace umbriel::numerics
