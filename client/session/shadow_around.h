#pragma once

#include <vector>

#include "client/session/shadow_fit.h"

namespace umbriel {

// Maps all around a point light, the same whoever looks.

// Six maps of 90 degrees and a border each: the border holds what the neighbouring face's texels hold, so that a
// surface moved by the biases, and a filter, stay on the face that its unmoved place chose. Axes of the world; the
// fits' parts are +x, -x, +y, -y, +z, -z. range: metres, 0: unlimited. None when the scene is empty or out of reach.
std::vector<ShadowFit> fitCube(const glm::dvec3& positionWorld, double range, const Box3d& sceneBounds,
                               const ShadowFitRequest& request);

// Two paraboloids (Brabec, Annen & Seidel 2002): part 0 along the world's -z, part 1 along +z. A direction d of a
// hemisphere around the axis a lies at (d.x, d.y) / (1 + d.a), the depth is linear in the distance. clipFromWorld maps
// distances only (its z row is used).
std::vector<ShadowFit> fitHemispheres(const glm::dvec3& positionWorld, double range, const Box3d& sceneBounds,
                                      const ShadowFitRequest& request);

}  // namespace umbriel
