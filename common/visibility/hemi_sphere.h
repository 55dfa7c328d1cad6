#pragma once

#include "common/visibility/mapping.h"

namespace umbriel::visibility::hemi_sphere {

// One image of 2s x s/2 pixels: azimuth pi (i + 1/2) / s, elevation over the horizon pi (j + 1/2) / s (Ganster 2002,
// eq. 21-23). Its angle is an elevation, so the cosine against the normal is sin(elevation) and the solid angle of a
// pixel is pi/s (sin e1 - sin e0): eq. 47-49 take it for a polar angle in both, and the errors nearly cancel in the
// product, which is why the two are tested apart.
glm::dvec3 direction(std::uint32_t s, std::uint32_t pixel);
std::optional<std::uint32_t> pixelOf(std::uint32_t s, const glm::dvec3& direction);
double cosineWeight(std::uint32_t s, std::uint32_t pixel);
double solidAngle(std::uint32_t s, std::uint32_t pixel);
double midpointCosineWeight(std::uint32_t s, std::uint32_t pixel);
double midpointSolidAngle(std::uint32_t s, std::uint32_t pixel);
glm::dvec3 vectorWeight(std::uint32_t s, std::uint32_t pixel);
std::vector<Neighbours> neighbours(std::uint32_t s);

}  // namespace umbriel::visibility::hemi_sphere
