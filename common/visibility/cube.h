#pragma once

#include "common/visibility/mapping.h"

namespace umbriel::visibility::cube {

// Both sides of an open mesh: six images s x s, +x, +y, -x, -y (rows from the bottom up), top (+z), bottom (-z). As
// each half is seen from its own side of the surface this is two HemiCubes (Ganster 2002, end of 2.3).
std::uint32_t pixelCount(std::uint32_t s);
glm::dvec3 direction(std::uint32_t s, std::uint32_t pixel);
std::optional<std::uint32_t> pixelOf(std::uint32_t s, const glm::dvec3& direction);
double cosineWeight(std::uint32_t s, std::uint32_t pixel);
double solidAngle(std::uint32_t s, std::uint32_t pixel);
double midpointCosineWeight(std::uint32_t s, std::uint32_t pixel);
double midpointSolidAngle(std::uint32_t s, std::uint32_t pixel);
std::vector<glm::dvec3> corners(std::uint32_t s, std::uint32_t pixel);
// Not across the horizon: there the map changes sides of the surface.
std::vector<Neighbours> neighbours(std::uint32_t s);

}  // namespace umbriel::visibility::cube
