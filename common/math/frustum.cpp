#include "common/math/frustum.h"

namespace umbriel {

namespace {

Plane normalised(const glm::dvec4& coefficients) {
    const glm::dvec3 normal(coefficients);
    const double length = glm::length(normal);
    if (length == 0.0) return {glm::dvec3(0.0), coefficients.w};
    return {normal / length, coefficients.w / length};
}

// Rounding of three products and three sums, times four: such a distance may as well be zero.
double doubt(const Plane& plane, const Box3d& box) {
    const glm::dvec3 largest = glm::max(glm::abs(box.lower), glm::abs(box.upper));
    return 1e-15 * (glm::dot(glm::abs(plane.normal), largest) + std::abs(plane.offset));
}

// The corner of a box that lies farthest along a direction.
glm::dvec3 cornerAlong(const Box3d& box, const glm::dvec3& direction) {
    return {direction.x > 0.0 ? box.upper.x : box.lower.x, direction.y > 0.0 ? box.upper.y : box.lower.y,
            direction.z > 0.0 ? box.upper.z : box.lower.z};
}

}  // namespace

Frustum frustumOf(const glm::dmat4& clipFromSource) {
    const glm::dmat4 rows = glm::transpose(clipFromSource);
    return {{normalised(rows[3] + rows[0]), normalised(rows[3] - rows[0]), normalised(rows[3] + rows[1]),
             normalised(rows[3] - rows[1]), normalised(rows[3] - rows[2]), normalised(rows[2])}};
}

bool mayIntersect(const Frustum& frustum, const Box3d& box) {
    if (box.empty()) return false;
    for (const Plane& plane : frustum.planes) {
        if (plane.signedDistance(cornerAlong(box, plane.normal)) < -doubt(plane, box)) return false;
    }
    return true;
}

bool surelyContains(const Frustum& frustum, const Box3d& box) {
    if (box.empty()) return false;
    for (const Plane& plane : frustum.planes) {
        if (!(plane.signedDistance(cornerAlong(box, -plane.normal)) >= doubt(plane, box))) return false;
    }
    return true;
}

}  // namespace umbriel
