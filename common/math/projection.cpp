#include "common/math/projection.h"

#include <cmath>

#include "common/base/assert.h"
#include "common/math/affine.h"

namespace umbriel {

glm::dmat4 reversedPerspective(double fovY, double aspect, double nearDistance) {
    const double top = nearDistance * std::tan(0.5 * fovY);
    return reversedFrustum(-top * aspect, top * aspect, -top, top, nearDistance);
}

glm::dmat4 reversedPerspective(double fovY, double aspect, double nearDistance, double farDistance) {
    const double top = nearDistance * std::tan(0.5 * fovY);
    return reversedFrustum(-top * aspect, top * aspect, -top, top, nearDistance, farDistance);
}

glm::dmat4 reversedFrustum(double left, double right, double bottom, double top, double nearDistance,
                           double farDistance) {
    UMBRIEL_ASSERT(left < right && bottom < top && nearDistance > 0.0, "a frustum needs an extent and a near plane");
    UMBRIEL_ASSERT(farDistance == 0.0 || farDistance > nearDistance, "the far plane lies beyond the near plane");
    glm::dmat4 clipFromView(0.0);
    clipFromView[0][0] = 2.0 * nearDistance / (right - left);
    clipFromView[1][1] = 2.0 * nearDistance / (top - bottom);
    clipFromView[2][0] = (right + left) / (right - left);
    clipFromView[2][1] = (top + bottom) / (top - bottom);
    clipFromView[2][3] = -1.0;
    if (farDistance == 0.0) {
        clipFromView[3][2] = nearDistance;  // depth = near / distance
    } else {
        // depth = a + b / distance with depth(near) = 1, depth(far) = 0.
        clipFromView[2][2] = nearDistance / (farDistance - nearDistance);
        clipFromView[3][2] = farDistance * clipFromView[2][2];
    }
    return clipFromView;
}

glm::dmat4 reversedOrthographic(double left, double right, double bottom, double top, double nearDistance,
                                double farDistance) {
    UMBRIEL_ASSERT(left < right && bottom < top && nearDistance < farDistance, "a view volume needs an extent");
    glm::dmat4 clipFromView(1.0);
    clipFromView[0][0] = 2.0 / (right - left);
    clipFromView[1][1] = 2.0 / (top - bottom);
    clipFromView[2][2] = 1.0 / (farDistance - nearDistance);
    clipFromView[3][0] = -(right + left) / (right - left);
    clipFromView[3][1] = -(top + bottom) / (top - bottom);
    clipFromView[3][2] = farDistance / (farDistance - nearDistance);
    return clipFromView;
}

Result<ScreenProjection> generalisedPerspective(const glm::dvec3& lowerLeft, const glm::dvec3& lowerRight,
                                                const glm::dvec3& upperLeft, const glm::dvec3& eye,
                                                double nearDistance) {
    if (!isFinite(lowerLeft) || !isFinite(lowerRight) || !isFinite(upperLeft) || !isFinite(eye))
        return badInput("a screen corner or the eye is not a finite point");
    if (!(nearDistance > 0.0) || !std::isfinite(nearDistance)) return badInput("the near distance must be positive");
    const glm::dvec3 across = lowerRight - lowerLeft;
    const glm::dvec3 upward = upperLeft - lowerLeft;
    const double width = glm::length(across);
    const double height = glm::length(upward);
    if (!(width > 0.0) || !(height > 0.0)) return badInput("two of the screen's corners coincide");
    const glm::dvec3 right = across / width;
    if (std::abs(glm::dot(right, upward / height)) > 1e-3)
        return badInput("the screen's corners do not form a right angle at the lower left one");
    const glm::dvec3 normal = glm::normalize(glm::cross(right, upward));
    const glm::dvec3 up = glm::cross(normal, right);

    const glm::dvec3 eyeToCorner = lowerLeft - eye;
    const double distance = -glm::dot(eyeToCorner, normal);
    if (!(distance > 1e-9 * (width + height)))
        return badInput(
            "the eye lies in the screen's plane or behind it (corners: lower left, lower right, upper left)");
    const double scale = nearDistance / distance;
    const double left = glm::dot(right, eyeToCorner) * scale;
    const double bottom = glm::dot(up, eyeToCorner) * scale;
    ScreenProjection result;
    result.viewFromWorld = glm::transpose(glm::dmat3(right, up, normal));
    result.clipFromView = reversedFrustum(left, left + width * scale, bottom, bottom + height * scale, nearDistance);
    return result;
}

glm::dmat4 cropped(const glm::dmat4& clipFromView, double left, double bottom, double right, double top) {
    UMBRIEL_ASSERT(left < right && bottom < top, "a part of a picture has an extent");
    glm::dmat4 cropFromWhole(1.0);
    cropFromWhole[0][0] = 1.0 / (right - left);
    cropFromWhole[1][1] = 1.0 / (top - bottom);
    cropFromWhole[3][0] = (1.0 - left - right) / (right - left);
    cropFromWhole[3][1] = (1.0 - bottom - top) / (top - bottom);
    return cropFromWhole * clipFromView;
}

glm::dmat4 cropped(const glm::dmat4& clipFromView, const PixelRect& part, PixelSize whole) {
    const double width = whole.width;
    const double height = whole.height;
    return cropped(clipFromView, part.x / width, part.y / height, (part.x + part.width) / width,
                   (part.y + part.height) / height);
}

glm::dmat4 reversedFromOpenGl(const glm::dmat4& openGlClipFromView) {
    glm::dmat4 ours = openGlClipFromView;
    for (int column = 0; column < 4; ++column)
        ours[column][2] = 0.5 * (openGlClipFromView[column][3] - openGlClipFromView[column][2]);
    return ours;
}

}  // namespace umbriel
