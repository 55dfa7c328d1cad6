#pragma once

#include <array>
#include <limits>
#include <span>
#include <vector>

#include "common/math/glm.h"
#include "common/math/pixel_rect.h"
#include "common/wall/view.h"

namespace umbriel {

// Axis-parallel, in the space of its points; empty until a point is added.
struct Box {
    glm::vec3 minimum{std::numeric_limits<float>::infinity()};
    glm::vec3 maximum{-std::numeric_limits<float>::infinity()};

    bool empty() const { return !(minimum.x <= maximum.x); }
    void add(const glm::vec3& point) {
        minimum = glm::min(minimum, point);
        maximum = glm::max(maximum, point);
    }
    void add(const Box& box) {
        minimum = glm::min(minimum, box.minimum);
        maximum = glm::max(maximum, box.maximum);
    }
    glm::dvec3 centre() const { return (glm::dvec3(minimum) + glm::dvec3(maximum)) * 0.5; }
    std::array<glm::dvec3, 8> corners() const;
};

// Inside is where dot(plane, (point, 1)) >= 0.
using Plane = glm::dvec4;

// What a rectangle of the wall sees of the world, relative to the view's eye (world axes): left, right, bottom, top,
// near, far. The far plane of an infinite projection is one that everything is inside of, as all planes of an unwrapped
// view are.
struct Frustum {
    std::array<Plane, 6> planes;
    // The four corners of the near plane, counter-clockwise from the lower left.
    std::array<glm::dvec3, 4> nearCorners;
};

// clipFromRelative: the view's projection times its rotation. pixels: on the wall; marginPixels widens it, because
// rasterisation happens in rounded window coordinates.
Frustum tileFrustum(const View& view, const PixelRect& pixels, double marginPixels);

// The projection of a view, from eye-relative world coordinates to clip space.
glm::dmat4 clipFromRelativeOf(const View& view);

// The pixels of the wall that a box, placed by relativeFromObject, may cover: all of the view's where it reaches to or
// behind the eye.
PixelRect pixelsOf(const View& view, const Box& box, const glm::dmat4& relativeFromObject, double marginPixels);

enum class Overlap { Outside, Partial, Inside };

// The frustum in the space of an object.
struct ObjectFrustum {
    ObjectFrustum() = default;  // nothing is outside
    ObjectFrustum(const Frustum& frustum, const glm::dmat4& relativeFromObject);
    // Conservative: a box near a corner of the frustum may count as Partial although it is outside.
    Overlap classify(const Box& box) const;
    // Whether all of it lies behind the near plane, which then cuts nothing off; false of an empty box.
    bool isBeyondNear(const Box& box) const;

    std::array<Plane, 6> planes{};
};

// Points whose convex hull contains the intersection of a box (placed by relativeFromObject) with the frustum; none
// when they do not meet. They replace those in `points`: thousands of boxes a frame share its memory.
void hullOfIntersection(const Box& box, const glm::dmat4& relativeFromObject, const Frustum& frustum,
                        std::vector<glm::dvec3>& points);

}  // namespace umbriel
