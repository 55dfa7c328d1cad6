#pragma once

#include <array>
#include <span>

#include "common/math/glm.h"

namespace umbriel::visibility {

// Integrals over rectangles of a plane at distance 1, in closed form.

// Of the cosine against the plane's normal, over [x0,x1] x [y0,y1] (Ganster 2002, eq. 44-46 replaced by their
// antiderivative, so that the sums are exact at every resolution).
double parallelCosine(double x0, double x1, double y0, double y1);
// Of |cos| against the z axis, over [y0,y1] x [z0,z1] of the plane x = 1; z0, z1 of one sign.
double perpendicularCosine(double y0, double y1, double z0, double z1);
// Solid angle of [x0,x1] x [y0,y1].
double planeSolidAngle(double x0, double x1, double y0, double y1);

// For a polygon on the unit sphere with great-circle edges, corners counter-clockwise seen from outside, any length.
// Solid angle: Van Oosterom and Strackee 1983.
double polygonSolidAngle(std::span<const glm::dvec3> corners);
// Integral of the direction: half the sum over edges of angle times unit normal (Lambert 1760).
glm::dvec3 polygonVector(std::span<const glm::dvec3> corners);

}  // namespace umbriel::visibility
