#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/numerics/cases/formula_case.h"
#include "tests/numerics/points.h"

namespace umbriel::numerics {
namespace {

constexpr float kUlpBelowOne = 1.0f - 0x1p-24f;
// Far below a rounding of 1, and still far from where the squares of what is left underflow everything.
constexpr float kTiny = 1e-30f;
constexpr std::array kCosines{0.0f, 1e-8f, 1e-4f, 0.5f, kUlpBelowOne, 1.0f};
constexpr std::array kExponents{0.0f, 1e-3f, 1.0f, 1e3f, 1e4f, 1e6f};
constexpr std::array kRoughnesses{0.0f, 1e-4f, 0.045f, 0.5f, kUlpBelowOne, 1.0f};
constexpr std::array kDistances{0.0f, 1e-30f, 1e-8f, 0.01f, 1.0f, 1e9f, 1e19f};

glm::vec3 tilted(float cosine, float azimuth) {
    const float sine = std::sqrt(1.0f - cosine * cosine);
    return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

FormulaInput reflection(glm::vec3 normal, glm::vec3 toLight, glm::vec3 toEye, glm::vec3 colour, float unit,
                        float roughness, float shininess) {
    return {glm::vec4(normal, unit), glm::vec4(toLight, roughness), glm::vec4(toEye, shininess),
            glm::vec4(colour, std::min(shininess, 128.0f))};
}

void addReflectionExtremes(std::vector<FormulaInput>& points) {
    const glm::vec3 up(0, 0, 1);
    const glm::vec3 colour(1.0f, 0.5f, 0.0f);
    const auto add = [&](glm::vec3 normal, glm::vec3 toLight, glm::vec3 toEye) {
        for (size_t i = 0; i < kExponents.size(); ++i)
            for (const float unit : {0.0f, 1.0f})
                points.push_back(reflection(normal, toLight, toEye, colour, unit, kRoughnesses[i], kExponents[i]));
    };
    for (const float cosLight : kCosines)
        for (const float cosEye : kCosines)
            for (const float azimuth : {0.0f, 1.0f, 3.14159265f})
                add(up, tilted(cosLight, 0.0f), tilted(cosEye, azimuth));
    // Around the terminator, and light and eye opposite.
    for (const float z : {-0x1p-24f, -kTiny, 0.0f, kTiny, 0x1p-24f})
        for (const glm::vec3 eye : {glm::vec3(0, 1, 0), glm::vec3(-1, 0, z), glm::vec3(-1, 0, -z), glm::vec3(1, 0, -1)})
            add(up, {1, 0, z}, eye);
    // No directions, and directions that are not unit.
    add(glm::vec3(0), up, up);
    add(up, glm::vec3(0), up);
    add(up, up, glm::vec3(0));
    add(up, up, -up);
    add(up * 0.1f, up, tilted(0.3f, 1.0f));
    add(up * 1.5f, tilted(0.9f, 2.0f) * 0.7f, tilted(0.3f, 1.0f) * 1.25f);
}

// Colours of any size, from 1e-30 to 1e30.
glm::vec3 radiance(Sequence& sequence) {
    const float scale = std::exp2(sequence.between(-99.0f, 99.0f));
    return glm::vec3(sequence.unit(), sequence.unit(), sequence.unit()) * scale;
}

glm::vec3 coefficients(Sequence& sequence) {
    glm::vec3 k;
    for (int i = 0; i < 3; ++i) k[i] = sequence.unit() < 0.25f ? 0.0f : std::exp2(sequence.between(-10.0f, 4.0f));
    return k;
}

void addDistances(std::vector<FormulaInput>& points, size_t count) {
    for (const float d : kDistances)
        for (const float other : kDistances)
            for (const glm::vec3 k :
                 {glm::vec3(0), glm::vec3(1, 0, 0), glm::vec3(0, 1, 0), glm::vec3(0, 0, 1), glm::vec3(0, 0, 1e-30f)})
                points.push_back({glm::vec4(d, 0, other == d ? d : 0, d), glm::vec4(k, other),
                                  glm::vec4(0, 0, 0, other), glm::vec4(0)});
    Sequence sequence(101);
    while (points.size() < count) {
        const float d = std::exp2(sequence.between(-20.0f, 63.0f));
        const float range = d * std::exp2(sequence.between(-3.0f, 3.0f));
        points.push_back({glm::vec4(sequence.direction() * d, d), glm::vec4(coefficients(sequence), range),
                          glm::vec4(0, 0, 0, range), glm::vec4(0)});
    }
}

void addSpots(std::vector<FormulaInput>& points, size_t count) {
    const glm::vec3 axis(0, 0, -1);
    for (const float cosine : {-1.0f, -0.5f, 0.0f, 1e-8f, 0.5f, kUlpBelowOne, 1.0f})
        for (const float exponent : kExponents)
            for (const float cone : {-1.0f, 0.0f, 0.5f, 1.0f})
                for (const float d : {0.0f, 1.0f, 1e19f}) {
                    glm::vec3 direction = tilted(std::abs(cosine), 0.4f);
                    if (cosine > 0) direction.z = -direction.z;
                    points.push_back({glm::vec4(direction, d), glm::vec4(axis, exponent),
                                      glm::vec4(0, 0, d > 0.5f ? 1.0f : 0.0f, cone), glm::vec4(cone, 0, 0, 0)});
                }
    Sequence sequence(102);
    while (points.size() < count) {
        const glm::vec3 about = sequence.direction();
        const float width = std::exp2(sequence.between(-8.0f, 2.0f));
        const glm::vec3 direction = glm::normalize(about + width * sequence.direction());
        const float cone = sequence.between(-1.0f, 1.0f);
        points.push_back({glm::vec4(direction, std::exp2(sequence.between(-10.0f, 20.0f))),
                          glm::vec4(about, std::exp2(sequence.between(-3.0f, 14.0f))),
                          glm::vec4(coefficients(sequence), cone), glm::vec4(sequence.between(cone, 1.0f), 0, 0, 0)});
    }
}

void addFogs(std::vector<FormulaInput>& points, size_t count) {
    for (const float d : kDistances)
        for (const float density : {0.0f, 1e-30f, 1e-3f, 1.0f, 1e6f})
            for (const glm::vec2 ends : {glm::vec2(0, 0), glm::vec2(0, 1), glm::vec2(1, 1), glm::vec2(0, 1e19f)})
                points.push_back({glm::vec4(1e30f, 1e-30f, 0, d), glm::vec4(0, 1e30f, 1e-30f, density),
                                  glm::vec4(ends, 0, density > 0 ? 1 : 0), glm::vec4(0)});
    Sequence sequence(103);
    while (points.size() < count) {
        const float d = std::exp2(sequence.between(-10.0f, 20.0f));
        const float density = std::exp2(sequence.between(-8.0f, 6.0f)) / d;
        const float start = d * sequence.between(0.0f, 2.0f);
        const glm::vec3 colour = radiance(sequence);
        points.push_back({glm::vec4(colour, d), glm::vec4(radiance(sequence), density),
                          glm::vec4(start, start + d * sequence.between(0.0f, 2.0f), 0, sequence.unit()),
                          glm::vec4(0)});
    }
}

void addDirections(std::vector<FormulaInput>& points, size_t count) {
    for (const float x : {-1.0f, 0.0f, kTiny, 1.0f})
        for (const float y : {-1.0f, -1e-8f, 0.0f, 1.0f})
            for (const float z : {-1.0f, 0.0f, 1.0f})
                for (const float scale : {1.0f, 1e-18f, 1e18f}) {
                    const glm::vec3 v(x, y, z);
                    const float length = std::max({std::abs(x), std::abs(y), std::abs(z)}) < 0.5f ? 0 : glm::length(v);
                    points.push_back({glm::vec4(v * scale, x * x),
                                      glm::vec4(length > 0 ? v / length : glm::vec3(0), y * y),
                                      glm::vec4(0, 0, 0, scale > 1 ? 4096.5f : 1.5f), glm::vec4(0, 0, 0, 2.5f)});
                }
    Sequence sequence(104);
    while (points.size() < count) {
        const glm::vec3 a = sequence.direction() * std::exp2(sequence.between(-60.0f, 60.0f));
        points.push_back({glm::vec4(a, sequence.unit()), glm::vec4(sequence.direction(), sequence.unit()),
                          glm::vec4(0, 0, 0, std::floor(std::exp2(sequence.between(0.0f, 12.0f))) + 0.5f),
                          glm::vec4(0, 0, 0, std::floor(std::exp2(sequence.between(1.0f, 12.0f))) + 0.5f)});
    }
}

void addFrames(std::vector<FormulaInput>& points, size_t count) {
    const glm::vec3 up(0, 0, 1);
    for (const glm::vec3 normal : {glm::vec3(0), up, up * 1e-30f, up * 1e30f})
        for (const glm::vec3 tangent : {glm::vec3(0), up, -up, glm::vec3(1, 0, 0), glm::vec3(1, 0, 1) * 1e30f})
            for (const glm::vec3 texel : {glm::vec3(0.5f), glm::vec3(0.5f, 0.5f, 1), glm::vec3(1, 0, 0)})
                points.push_back({glm::vec4(normal, 0), glm::vec4(tangent, 0), glm::vec4(texel, 1), glm::vec4(0)});
    Sequence sequence(105);
    while (points.size() < count)
        points.push_back({glm::vec4(sequence.direction() * std::exp2(sequence.between(-30.0f, 30.0f)), 0),
                          glm::vec4(sequence.direction() * std::exp2(sequence.between(-30.0f, 30.0f)), 0),
                          glm::vec4(sequence.unit(), sequence.unit(), sequence.unit(), sequence.between(0.0f, 2.0f)),
                          glm::vec4(0)});
}

void addUnits(std::vector<FormulaInput>& points, size_t count) {
    for (const float x : {0.0f, kTiny, 1e-8f, 0.0031308f, 0.04045f, kUlpBelowOne, 1.0f})
        points.push_back({glm::vec4(x), glm::vec4(x), glm::vec4(x), glm::vec4(x)});
    Sequence sequence(106);
    while (points.size() < count) {
        FormulaInput in;
        for (glm::vec4& v : in) v = {sequence.unit(), sequence.unit(), sequence.unit(), sequence.unit()};
        points.push_back(in);
    }
}

}  // namespace

std::vector<FormulaInput> formulaPoints(FormulaDomain domain, size_t count) {
    std::vector<FormulaInput> points;
    points.reserve(count);
    switch (domain) {
        case FormulaDomain::Reflection: {
            addReflectionExtremes(points);
            for (const ReflectionPoint& p : reflectionPoints(count - std::min(count, points.size()), 100))
                points.push_back(
                    reflection(p.normal, p.toLight, p.toEye, p.colour, p.metallic, p.roughness, p.shininess));
            break;
        }
        case FormulaDomain::Distance:
            addDistances(points, count);
            break;
        case FormulaDomain::Spot:
            addSpots(points, count);
            break;
        case FormulaDomain::Fog:
            addFogs(points, count);
            break;
        case FormulaDomain::Direction:
            addDirections(points, count);
            break;
        case FormulaDomain::Unit:
            addUnits(points, count);
            break;
        case FormulaDomain::Frame:
            addFrames(points, count);
            break;
    }
    return points;
}

}  // namespace umbriel::numerics
