#include "common/math/rotation.h"

#include <cmath>

#include "common/math/affine.h"

namespace umbriel {

namespace {

// Unit length for any finite vector but zero: scaled by its largest component first, so that nothing over- or
// underflows.
std::optional<glm::dvec3> unit(const glm::dvec3& v) {
    if (!isFinite(v)) return std::nullopt;
    const double largest = std::max(std::abs(v.x), std::max(std::abs(v.y), std::abs(v.z)));
    if (largest == 0.0) return std::nullopt;
    return glm::normalize(v / largest);
}

}  // namespace

std::optional<glm::dmat3> rotationLookingAlong(const glm::dvec3& forward, const glm::dvec3& up) {
    const auto direction = unit(forward);
    if (!direction || !isFinite(up)) return std::nullopt;
    const glm::dvec3 backward = -*direction;
    const auto above = unit(up);
    glm::dvec3 right = above ? glm::cross(*above, backward) : glm::dvec3(0.0);
    // Below 1e-6 rad the cross product of unit vectors still has 10 digits, yet its direction is the user's rounding.
    if (glm::length(right) < 1e-6) {
        const glm::dvec3 a = glm::abs(backward);
        const glm::dvec3 axis = a.x <= a.y && a.x <= a.z ? glm::dvec3(1, 0, 0)
                                : a.y <= a.z             ? glm::dvec3(0, 1, 0)
                                                         : glm::dvec3(0, 0, 1);
        right = glm::cross(axis, backward);
    }
    right = glm::normalize(right);
    return glm::dmat3(right, glm::cross(backward, right), backward);
}

std::optional<glm::dmat3> orthonormalised(const glm::dmat3& frame) {
    if (!isFinite(frame)) return std::nullopt;
    return rotationLookingAlong(-frame[2], frame[1]);
}

}  // namespace umbriel
