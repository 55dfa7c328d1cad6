#pragma once

#include <vector>

#include "common/math/box.h"
#include "common/math/frustum.h"

namespace umbriel {

// A convex polyhedron by its faces, made of a box and cut by planes; what shadow fits take for "the part of the scene
// that somebody sees". A flat box works: its faces then lie on each other.
class ConvexBody {
 public:
    // The box, moved by -origin: give the eye or the light, so that what is near it keeps its digits.
    ConvexBody(const Box3d& box, const glm::dvec3& origin);

    // Keeps what is inside the plane, and points outside by rounding.
    void cut(const Plane& plane);

    bool empty() const { return _faces.empty(); }
    // Corners, with repetitions.
    std::vector<glm::dvec3> corners() const;

 private:
    using Face = std::vector<glm::dvec3>;
    std::vector<Face> _faces;
    double _tolerance = 0.0;  // metres
};

}  // namespace umbriel
