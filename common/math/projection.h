#pragma once

#include "common/base/result.h"
#include "common/math/glm.h"
#include "common/math/pixel_rect.h"

namespace umbriel {

// Projections to our clip space: x and y in [-w, w], reversed depth z in [0, w]: 1 at the near plane, 0 at the far
// plane or at infinity. View space looks along -z, +y up. Everything in double; distances in metres, angles in radians.
// Float depth then resolves a constant share of the distance, about 2^-24 (Reed, "Depth precision visualized", 2015).

// 0 < fovY < pi (vertical), aspect = width / height > 0, nearDistance > 0.
glm::dmat4 reversedPerspective(double fovY, double aspect, double nearDistance);
// The same, with depth 0 at farDistance > nearDistance.
glm::dmat4 reversedPerspective(double fovY, double aspect, double nearDistance, double farDistance);

// Off-axis: the window's edges on the near plane, left < right, bottom < top. farDistance 0: infinite.
glm::dmat4 reversedFrustum(double left, double right, double bottom, double top, double nearDistance,
                           double farDistance = 0.0);

// nearDistance < farDistance, both may be negative (behind the eye).
glm::dmat4 reversedOrthographic(double left, double right, double bottom, double top, double nearDistance,
                                double farDistance);

// A planar screen seen by an eye anywhere in front of it (Kooima, "Generalized perspective projection", 2009).
struct ScreenProjection {
    glm::dmat3 viewFromWorld{1.0};  // rotation; the view looks perpendicular to the screen
    glm::dmat4 clipFromView{1.0};   // off-axis, infinite far
};
// Corners in world metres. An error when the corners span no rectangle (within 1e-3 of a right angle), or the eye lies
// in the screen's plane or behind it.
Result<ScreenProjection> generalisedPerspective(const glm::dvec3& lowerLeft, const glm::dvec3& lowerRight,
                                                const glm::dvec3& upperLeft, const glm::dvec3& eye,
                                                double nearDistance);

// The part of a picture between these fractions of its width and height ((0,0) is the lower left corner) becomes the
// whole picture. left < right, bottom < top; they may reach beyond [0,1].
glm::dmat4 cropped(const glm::dmat4& clipFromView, double left, double bottom, double right, double top);

// The same in pixels: clipFromView of the part, given that of the whole.
glm::dmat4 cropped(const glm::dmat4& clipFromView, const PixelRect& part, PixelSize whole);

// From OpenGL's clip space, z in [-w, w] and near at -w, to ours.
glm::dmat4 reversedFromOpenGl(const glm::dmat4& openGlClipFromView);

}  // namespace umbriel
