#pragma once

#include <cmath>

#include "client/session/shadow_fit.h"
#include "common/math/projection.h"
#include "common/math/rotation.h"
#include "common/wall/view.h"

namespace umbriel::test {

// A symmetric picture of 16:9 from one place towards another, up along y.
inline View viewFrom(const glm::dvec3& eyeWorld, const glm::dvec3& targetWorld, double fovY = 0.8,
                     double nearDistance = 0.1) {
    View view;
    view.eyeWorld = eyeWorld;
    view.viewFromWorld = glm::transpose(*rotationLookingAlong(targetWorld - eyeWorld, {0, 1, 0}));
    view.clipFromView = reversedPerspective(fovY, 16.0 / 9.0, nearDistance);
    view.nearDistance = nearDistance;
    return view;
}

// Whether a point lies in the picture, in front of the near plane.
inline bool isSeen(const View& view, const glm::dvec3& world) {
    const glm::dvec4 clip = view.clipFromView * glm::dvec4(view.viewFromWorld * (world - view.eyeWorld), 1.0);
    return clip.w > 0.0 && std::abs(clip.x) <= clip.w && std::abs(clip.y) <= clip.w && clip.z >= 0.0 &&
           clip.z <= clip.w;
}

// Where a point lies on the map: -1 to 1 across, depth from 1 at the light to 0.
inline glm::dvec3 mapped(const ShadowFit& fit, const glm::dvec3& world) {
    const glm::dvec4 clip = fit.clipFromWorld * glm::dvec4(world, 1.0);
    return glm::dvec3(clip) / clip.w;
}

}  // namespace umbriel::test
