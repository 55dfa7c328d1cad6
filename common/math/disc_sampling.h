#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "common/math/glm.h"

namespace umbriel {

// Uniform in [0, 1), a function of its arguments only (the finaliser of MurmurHash3, Appleby 2011).
inline double hashedUnit(std::uint64_t place, std::uint64_t sample) {
    std::uint64_t h = place * 0x9e3779b97f4a7c15ULL + sample * 0xc2b2ae3d27d4eb4fULL + 0x165667b19e3779f9ULL;
    h = (h ^ (h >> 33)) * 0xff51afd7ed558ccdULL;
    h = (h ^ (h >> 33)) * 0xc4ceb9fe1a85ec53ULL;
    return static_cast<double>((h ^ (h >> 33)) >> 11) * 0x1p-53;
}

// From the unit square to the unit disc, areas kept (Shirley and Chiu 1997).
inline glm::dvec2 discFromSquare(double x, double y) {
    const double a = 2.0 * x - 1.0, b = 2.0 * y - 1.0;
    if (a == 0.0 && b == 0.0) return glm::dvec2(0.0);
    const bool wide = std::abs(a) > std::abs(b);
    const double radius = wide ? a : b;
    const double angle =
        wide ? 0.25 * std::numbers::pi * (b / a) : 0.5 * std::numbers::pi - 0.25 * std::numbers::pi * (a / b);
    return {radius * std::cos(angle), radius * std::sin(angle)};
}

// Two unit vectors across a direction (not zero) and across each other.
struct AxesAcross {
    glm::dvec3 u, v;
};
inline AxesAcross axesAcross(const glm::dvec3& direction) {
    const glm::dvec3 d = glm::normalize(direction);
    const glm::dvec3 helper = std::abs(d.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 u = glm::normalize(glm::cross(d, helper));
    return {u, glm::cross(d, u)};
}

}  // namespace umbriel
