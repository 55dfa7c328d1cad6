#pragma once

#include <array>
#include <limits>

#include "common/math/affine.h"
#include "common/math/glm.h"

namespace umbriel {

// An axis-aligned box in double; empty (lower > upper) until something is included. A box may be flat or a single
// point.
struct Box3d {
    glm::dvec3 lower{std::numeric_limits<double>::infinity()};
    glm::dvec3 upper{-std::numeric_limits<double>::infinity()};

    bool empty() const { return !(lower.x <= upper.x && lower.y <= upper.y && lower.z <= upper.z); }
    void include(const glm::dvec3& point) {
        lower = glm::min(lower, point);
        upper = glm::max(upper, point);
    }
    void include(const Box3d& box) {
        if (box.empty()) return;
        include(box.lower);
        include(box.upper);
    }
    // The following are for boxes that are not empty.
    glm::dvec3 centre() const { return lower + 0.5 * (upper - lower); }
    glm::dvec3 size() const { return upper - lower; }
    double diagonal() const { return glm::length(size()); }
    // Corner i has the upper x, y, z where bit 0, 1, 2 of i is set.
    glm::dvec3 corner(int i) const {
        return {(i & 1) ? upper.x : lower.x, (i & 2) ? upper.y : lower.y, (i & 4) ? upper.z : lower.z};
    }
    bool contains(const glm::dvec3& point) const {
        return glm::all(glm::lessThanEqual(lower, point)) && glm::all(glm::lessThanEqual(point, upper));
    }
    friend bool operator==(const Box3d&, const Box3d&) = default;
};

// The smallest box around the transformed box (Arvo, Graphics Gems 1990). Empty stays empty.
inline Box3d transformed(const Affine& toFromSource, const Box3d& box) {
    if (box.empty()) return {};
    Box3d result{toFromSource.translation, toFromSource.translation};
    for (int column = 0; column < 3; ++column) {
        const glm::dvec3 a = toFromSource.linear[column] * box.lower[column];
        const glm::dvec3 b = toFromSource.linear[column] * box.upper[column];
        result.lower += glm::min(a, b);
        result.upper += glm::max(a, b);
    }
    return result;
}

}  // namespace umbriel
