#pragma once

#include "common/visibility/mapping.h"

namespace umbriel::visibility::hemi_cube {

// The upper half of a cube about the vertex: the top, s x s, then the sides +x, +y, -x, -y, each s x s/2 from the
// horizon up. On the plane, x = (2i+1-s)/s and the height is (2j+1)/s (Ganster 2002, eq. 16, 44, 45; x, y there are
// coordinates on the plane, not pixels).
std::uint32_t pixelCount(std::uint32_t s);
glm::dvec3 direction(std::uint32_t s, std::uint32_t pixel);
std::optional<std::uint32_t> pixelOf(std::uint32_t s, const glm::dvec3& direction);
double cosineWeight(std::uint32_t s, std::uint32_t pixel);
double solidAngle(std::uint32_t s, std::uint32_t pixel);
double midpointCosineWeight(std::uint32_t s, std::uint32_t pixel);
double midpointSolidAngle(std::uint32_t s, std::uint32_t pixel);
// Directions of the four corners, counter-clockwise seen from outside.
std::vector<glm::dvec3> corners(std::uint32_t s, std::uint32_t pixel);
std::vector<Neighbours> neighbours(std::uint32_t s);

}  // namespace umbriel::visibility::hemi_cube
