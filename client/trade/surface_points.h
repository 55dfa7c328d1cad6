#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "common/image/image.h"
#include "common/wall/view.h"

namespace umbriel {

// What a renderer drew, as surface points: the layers depth, position, normal and ids of one view that fills the wall.
// Row 0 is the top one.
struct SurfacePoints {
    int width = 0;
    int height = 0;
    glm::dvec3 eyeWorld{0.0};
    glm::dvec3 forwardWorld{0, 0, -1};  // unit, along the view
    bool isOrthographic = false;
    std::vector<glm::vec3> relative;   // to the eye, world axes, metres
    std::vector<glm::vec3> normals;    // geometric, facing the viewer, unit
    std::vector<float> depths;         // along the view, metres; 0: background
    std::vector<std::uint32_t> nodes;  // low 32 bits of ids; ~0: background
    std::vector<std::uint32_t> primitives;

    std::size_t size() const { return depths.size(); }
    bool covered(std::size_t i) const { return nodes[i] != ~0u; }
    glm::dvec3 world(std::size_t i) const { return eyeWorld + glm::dvec3(relative[i]); }
};

// The layers that surfacePoints() needs.
inline constexpr std::uint32_t kSurfaceLayers =
    static_cast<std::uint32_t>(Layer::Colour) | static_cast<std::uint32_t>(Layer::Depth) |
    static_cast<std::uint32_t>(Layer::Position) | static_cast<std::uint32_t>(Layer::Normal) |
    static_cast<std::uint32_t>(Layer::Ids);

// Failure when a layer is missing.
Result<SurfacePoints> surfacePoints(const LayeredImage& picture, const View& view);

// 1 where one of the eight neighbours is background or lies on another surface: farther than 1.5 pixels (at this depth)
// from this pixel's tangent plane while this point is as far from the neighbour's. A crease between two visible faces
// is none. The picture's border counts as one.
std::vector<std::uint8_t> silhouettes(const SurfacePoints& points);

// Thirds of the depths of the marked pixels, from the nearest to the farthest: 0 near, 1 middle, 2 far; 255 elsewhere.
// By ratio, as perspective makes things smaller (6 to 162 m: up to 18, 54, 162); in orthographic views by metres.
std::vector<std::uint8_t> depthZones(const SurfacePoints& points, const std::vector<std::uint8_t>& marked);

// For each pixel of `from` the index of the pixel of `to` that shows the same point: it projects into that pixel, and
// what is there lies within a pixel and a half of it on the same node. kNoMatch where it is hidden or outside.
inline constexpr std::uint32_t kNoMatch = ~0u;
std::vector<std::uint32_t> matchSurfaces(const SurfacePoints& from, const SurfacePoints& to, const View& toView);

// Likewise the four pixels of `to` whose centres surround the point's place; first the one that shows it. kNoMatch for
// those that show another node, or something else than the point's tangent plane, and for all where the first is that.
std::vector<std::array<std::uint32_t, 4>> surfacesAround(const SurfacePoints& from, const SurfacePoints& to,
                                                         const View& toView);

}  // namespace umbriel
