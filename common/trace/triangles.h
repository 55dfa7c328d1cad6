#pragma once

#include <span>
#include <vector>

#include "common/math/glm.h"

namespace umbriel::trace {

// Triangles whose corners are the same point exactly when they have the same index: equal positions are merged,
// repeated corners and triangles without area left out (visibility::BakeMesh makes them so). Borrowed.
struct Triangles {
    std::span<const glm::vec3> positions;
    std::span<const glm::uvec3> corners;
};

// The same triangles moved to the middle of their box and scaled to a diagonal of 1 to 2, without rounding: the scale
// is a power of two, and an axis is moved only where every coordinate stays exact. Where it would not, the box is near
// the origin already. Ray tracing in single precision then keeps its digits for meshes far from their origin.
struct NormalisedPositions {
    std::vector<glm::vec3> positions;
    glm::dvec3 centre{0.0};
    double scale = 1.0;     // normalised = (position - centre) * scale
    double diagonal = 0.0;  // of the box, normalised; 0 for a single point
};
NormalisedPositions normalise(std::span<const glm::vec3> positions);

}  // namespace umbriel::trace
