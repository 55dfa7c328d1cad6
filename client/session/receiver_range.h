#pragma once

#include <span>
#include <vector>

#include "common/math/box.h"
#include "common/wall/view.h"

namespace umbriel {

// What a view really sees of the scene: not the part of the scene's box within its frustum, which is mostly air, but
// the things in it. What hides behind others counts.
struct ReceiverRange {
    Box3d boundsWorld;     // around what lies within the frustum; empty: nothing does
    double nearest = 0.0;  // of that, along the view's axis from its eye, metres
    double farthest = 0.0;
};

// parts: boxes that hold everything (partBounds()). One range for each view, in their order. Costs a test of five
// planes for each part and view, and a cut for those that a plane runs through.
std::vector<ReceiverRange> receiverRanges(std::span<const Box3d> parts, std::span<const View> views);

}  // namespace umbriel
