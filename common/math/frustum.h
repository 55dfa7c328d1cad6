#pragma once

#include <array>

#include "common/math/box.h"
#include "common/math/glm.h"

namespace umbriel {

// Points with dot(normal, p) + offset >= 0 are inside. The normal has unit length, but for a plane at infinity (that of
// an infinite far distance), whose normal is zero and which has every point inside.
struct Plane {
    glm::dvec3 normal{0.0};
    double offset = 0.0;

    double signedDistance(const glm::dvec3& point) const { return glm::dot(normal, point) + offset; }
};

// What a clip matrix lets through: left, right, bottom, top, near, far.
struct Frustum {
    std::array<Plane, 6> planes;
};

// For our clip space (projection.h): -w <= x, y <= w and 0 <= z <= w (Gribb & Hartmann 2001). The planes are in the
// matrix' source frame; give clipFromWorld relative to the eye when the world is far from its origin.
Frustum frustumOf(const glm::dmat4& clipFromSource);

// False only when the box is surely outside, with room for rounding; may be true for a box that is outside near a
// corner. An empty box is outside.
bool mayIntersect(const Frustum& frustum, const Box3d& box);
// True only when the whole box is surely inside.
bool surelyContains(const Frustum& frustum, const Box3d& box);

}  // namespace umbriel
