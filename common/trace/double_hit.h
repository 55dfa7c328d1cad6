#pragma once

#include <optional>

#include "common/math/glm.h"

namespace umbriel::trace {

// Where the ray origin + t direction, t > 0, meets a triangle, in double; the corners are relative to the origin.
// Edge functions are signed volumes whose value for (a, b) is exactly minus that for (b, a), so of two triangles that
// share an edge at least one is hit by a ray through it, whatever is rounded. A triangle in whose plane the origin lies
// is not hit.
inline std::optional<double> hitDistance(const glm::dvec3& direction, const glm::dvec3& a, const glm::dvec3& b,
                                         const glm::dvec3& c) {
    const double u = glm::dot(direction, glm::cross(b, c));
    const double v = glm::dot(direction, glm::cross(c, a));
    const double w = glm::dot(direction, glm::cross(a, b));
    const bool inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    if (!inside) return std::nullopt;
    const double sum = u + v + w;
    if (sum == 0.0) return std::nullopt;
    // The volume by differences of corners, so that it does not drown when the origin is far away.
    const double distance = glm::dot(a, glm::cross(b - a, c - a)) / sum;
    if (!(distance > 0.0)) return std::nullopt;
    return distance;
}

}  // namespace umbriel::trace
