#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "common/math/glm.h"

namespace umbriel::numerics {

// A sequence that is the same everywhere (SplitMix64; the standard distributions differ between libraries).
class Sequence {
 public:
    explicit Sequence(uint64_t seed) : _state(seed) {}

    // In [0, 1), a multiple of 2^-24: the same number as float and as double.
    float unit() {
        _state += 0x9e3779b97f4a7c15ull;
        uint64_t z = _state;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
        z ^= z >> 31;
        return static_cast<float>(z >> 40) * 0x1p-24f;
    }

    float between(float low, float high) { return low + (high - low) * unit(); }

    // Uniform on the sphere, rounded to float.
    glm::vec3 direction() {
        const double z = 2.0 * unit() - 1.0;
        const double angle = 6.283185307179586 * unit();
        const double r = std::sqrt(1.0 - z * z);
        return {static_cast<float>(r * std::cos(angle)), static_cast<float>(r * std::sin(angle)),
                static_cast<float>(z)};
    }

    // Uniform on the hemisphere about `axis`.
    glm::vec3 directionAbout(glm::vec3 axis) {
        const glm::vec3 d = direction();
        return glm::dot(d, axis) < 0 ? -d : d;
    }

 private:
    uint64_t _state;
};

// One reflection: everything that a surface formula takes.
struct ReflectionPoint {
    glm::vec3 normal;
    glm::vec3 toLight;
    glm::vec3 toEye;
    glm::vec3 colour;
    float metallic = 0;
    float roughness = 0;
    float shininess = 0;
};

// Light and eye above the surface, about a quarter of them close to the mirror direction where lobes peak.
inline std::vector<ReflectionPoint> reflectionPoints(size_t count, uint64_t seed) {
    Sequence sequence(seed);
    std::vector<ReflectionPoint> points(count);
    for (ReflectionPoint& p : points) {
        p.normal = sequence.direction();
        p.toEye = sequence.directionAbout(p.normal);
        p.toLight = sequence.directionAbout(p.normal);
        if (sequence.unit() < 0.25f) {
            const glm::vec3 mirror = 2.0f * glm::dot(p.normal, p.toEye) * p.normal - p.toEye;
            p.toLight = glm::normalize(mirror + sequence.between(0.0f, 0.1f) * sequence.direction());
        }
        p.colour = {sequence.unit(), sequence.unit(), sequence.unit()};
        p.metallic = sequence.unit();
        p.roughness = sequence.unit();
        p.shininess = std::exp2(sequence.between(0.0f, 14.0f));
    }
    return points;
}

// A point whose directions are of unit length in double too: v.h = l.h holds for vectors of equal length only.
struct UnitReflectionPoint {
    explicit UnitReflectionPoint(const ReflectionPoint& p)
        : point(p),
          normal(glm::normalize(glm::dvec3(p.normal))),
          toLight(glm::normalize(glm::dvec3(p.toLight))),
          toEye(glm::normalize(glm::dvec3(p.toEye))),
          cosLight(glm::dot(normal, toLight)),
          cosEye(glm::dot(normal, toEye)) {}
    ReflectionPoint point;
    glm::dvec3 normal, toLight, toEye;
    double cosLight, cosEye;
};

// For reciprocity: of reflectionPoints(), those where light and eye are both well above the surface.
inline std::vector<UnitReflectionPoint> reciprocityPoints(size_t count, uint64_t seed) {
    std::vector<UnitReflectionPoint> points;
    for (const ReflectionPoint& p : reflectionPoints(count, seed)) {
        const UnitReflectionPoint unit(p);
        if (unit.cosLight >= 1e-3 && unit.cosEye >= 1e-3) points.push_back(unit);
    }
    return points;
}

// By how much the result of a formula moves, relatively, when directions move by one rounding error of float. This is
// the problem's own sensitivity: no way of computing in float can do better.
//
//   1 / (alpha |l + v|)   the half vector is rounded, and shorter sums of unit vectors have larger relative errors; a
//                         lobe of width alpha turns that into 1 / alpha of its value
//   1 / (n.l), 1 / (n.v)  small cosines are differences of products
inline double sensitivity(const ReflectionPoint& p, double lobeWidth) {
    const double sum = glm::length(glm::dvec3(p.toLight) + glm::dvec3(p.toEye));
    const double light = std::abs(glm::dot(glm::dvec3(p.normal), glm::dvec3(p.toLight)));
    const double eye = std::abs(glm::dot(glm::dvec3(p.normal), glm::dvec3(p.toEye)));
    return 1.0 + 1.0 / (lobeWidth * sum) + 1.0 / light + 1.0 / std::max(eye, 1e-4);
}

}  // namespace umbriel::numerics
