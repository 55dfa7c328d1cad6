#pragma once

#include <span>
#include <vector>

#include "common/math/box.h"
#include "common/math/frustum.h"
#include "common/wall/view.h"

namespace umbriel {

// A place where something may be that a view sees.
struct SeenPlace {
    glm::dvec3 relative{0.0};  // to the view's eye, world axes, metres
    double depth = 0.0;        // along the view's axis, not below leastDepth; of orthographic views 1 everywhere, as
                               // nothing looks larger there for being near
    double weight = 0.0;       // how much of the picture, and of depth, it stands for
};

// What a view sees is somewhere along the rays through its pixels: on 6 x 6 of them in the rectangle that the seen part
// of the box has on the picture, 3 places each, equally far apart in the logarithm of depth, as perspective shrinks
// things (below leastDepth in depth itself). A ray's weight is what it has of that within the box and the planes, both
// widened by a 64th of the box's diagonal, times the rectangle's area: hence a flat box has places, and none comes or
// goes all at once while the view moves.
//
// box in the world; corners of what is seen of it and planes relative to the view's eye; leastDepth positive. Nothing
// for a box that is empty or a point, and without corners.
std::vector<SeenPlace> seenPlaces(const View& view, const Box3d& box, std::span<const glm::dvec3> corners,
                                  std::span<const Plane> planes, double leastDepth);

}  // namespace umbriel
