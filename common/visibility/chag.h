#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "common/visibility/mapping.h"
#include "common/visibility/mesh.h"

namespace umbriel::visibility {

// Camera height above ground: how far a rasteriser lifts its eye along the normal so that the near plane cuts no hole
// into the vertex's own triangles (Ganster 2002, 2.3). Only GL makers need it.

// Smallest angle between the normal and a direction within one of the own triangles, radians. Over triangles, not edges
// as printed: inside a steep wedge a triangle rises faster than both of its edges. Pi/2 or more: nothing rises above
// the tangent plane. lower: against the reversed normal, for an eye on the other side.
double steepestAngle(const BakeMesh& mesh, std::uint32_t row, bool lower = false);

// For cube faces the region the near planes cut off is the half box |x|, |y|, z < near, so for an edge at any azimuth
// sqrt(2) near / tan(alpha); for SinglePlane it is a pyramid: near (sqrt(2) tan(fovy/2) / tan(alpha) - 1), where
// eq. 26 prints tan(fovy). Never less than epsilon, which is also the lift for alpha >= pi/2, where eq. 26 would be
// negative; alpha = 0 (the normal lies in a triangle) has no lift that helps and gives epsilon as well. Lengths in the
// unit of near.
double cameraHeight(MappingKind kind, double fovy, double alpha, double near, double epsilon);
// For an eye that looks all around, with cube faces at any angle to the surface: the near planes cut off a cube that
// lies within sqrt(3) near, so that is how far the eye stays from the own triangles: sqrt(3) near / sin(alpha), with
// alpha up to pi/2. Not in the thesis.
double cameraHeightAllAround(double alpha, double near, double epsilon);

}  // namespace umbriel::visibility
