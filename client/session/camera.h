#pragma once

#include <string>

#include "common/base/result.h"
#include "common/math/box.h"
#include "common/math/pixel_rect.h"
#include "common/scene/aspect.h"
#include "common/scene/cameras.h"
#include "common/scene/traversal.h"
#include "common/wall/view.h"

namespace umbriel {

// The camera that a viewport names, decorators and all, as the view of that region of the wall. sceneBounds (world)
// choose the near plane where the camera leaves it open (automaticNear). Only the direction of a beacon's -z and +y
// axes count: scale, shear and mirroring above a camera are dropped. Errors name the camera: no such camera, an
// impossible field of view or depth range, decorators that are nested in a circle.
Result<View> resolveCamera(const Aspect& aspect, Ref<Container> camera, const Hierarchy& hierarchy,
                           const PixelRect& region, const Box3d& sceneBounds);

// A near distance for a perspective camera that leaves it open: nine tenths of the distance, along the view axis, to
// the nearest corner of the scene's box, but at least 1/8192 of the box' diagonal, and then rounded down to a power of
// two so that it stays the same while things move a little. With reversed float depth a small near distance costs no
// precision at the far end, but triangles that pass close to the eye lose digits in interpolation: hence the floor.
// 0.125 for an empty scene.
double automaticNear(const Box3d& sceneBounds, const glm::dvec3& eyeWorld, const glm::dvec3& forwardWorld);

// Where somebody stands and looks.
struct LookAt {
    glm::dvec3 eyeWorld{0.0, 0.0, 1.0};
    glm::dvec3 targetWorld{0.0};
    glm::dvec3 upWorld{0.0, 1.0, 0.0};  // when it is parallel to the view, another direction is chosen
    double fovY = 0.785398163397448;    // radians
};

// The whole box in view, from front right and a little above, with a twentieth to spare on the tighter side. An empty
// box counts as one of 2 m around the origin, a single point as one of 2 m around it.
LookAt frameAll(const Box3d& bounds, double fovY, double aspect);

// A perspective camera with a beacon of its own, outside the scene's tree. An error when eye and target coincide,
// something is not finite, or the field of view is not between 0 and 180 degrees.
Result<Ref<PerspectiveCamera>> addCamera(Aspect& aspect, const std::string& name, const LookAt& pose);

}  // namespace umbriel
