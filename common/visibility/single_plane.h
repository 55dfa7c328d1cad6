#pragma once

#include "common/visibility/mapping.h"

namespace umbriel::visibility::single_plane {

// One image on the plane z = 1, s x s, |x|, |y| <= t = tan(fovy/2) (Ganster 2002, eq. 17; the area of a pixel is
// 4 t^2 / s^2, where eq. 46 forgets t^2). What lies outside the cone is lost.
glm::dvec3 direction(std::uint32_t s, double fovy, std::uint32_t pixel);
std::optional<std::uint32_t> pixelOf(std::uint32_t s, double fovy, const glm::dvec3& direction);
double cosineWeight(std::uint32_t s, double fovy, std::uint32_t pixel);
double solidAngle(std::uint32_t s, double fovy, std::uint32_t pixel);
double midpointCosineWeight(std::uint32_t s, double fovy, std::uint32_t pixel);
double midpointSolidAngle(std::uint32_t s, double fovy, std::uint32_t pixel);
std::vector<glm::dvec3> corners(std::uint32_t s, double fovy, std::uint32_t pixel);
std::vector<Neighbours> neighbours(std::uint32_t s, double fovy);
// 4 sin(fovy/2) atan(sin(fovy/2)).
double totalCosineWeight(double fovy);

// Angle between the normal and the direction of the pixel next to it, radians (eq. 18-20, table 3).
double firstRayAngle(std::uint32_t s, double fovy);
// The thesis' rule of thumb: usable below 6 degrees, below 7.5 from fovy 160 degrees on. Weak: even passing values
// carry the bias of the lost rim.
bool firstRayIsTooFar(std::uint32_t s, double fovy);

}  // namespace umbriel::visibility::single_plane
