#pragma once

#include <optional>
#include <span>
#include <vector>

#include "client/trade/surface_points.h"
#include "common/math/disc_sampling.h"

namespace umbriel {

// A step of one texel in x and in y of a light's map, as it lies on a surface: metres along two axes of the surface's
// plane. `fits` are all of one light: its map, or the faces or hemispheres around it, of which the one that holds the
// point counts. `relative` is the point from eyeWorld, metres. None where no map holds the point, or the light runs
// along the plane.
std::optional<glm::dmat2> surfaceFromTexels(std::span<const ShadowFit> fits, const glm::dvec3& eyeWorld,
                                            const glm::dvec3& relative, const AxesAcross& surface);

// How large texels are where they are looked up, over the marked pixels: for each pixel the side of the square that has
// a texel's area, 0 where there is none.
struct TexelSizes {
    std::vector<float> pixels;  // on the picture
    std::vector<float> metres;  // on the surface, seen along the light
};
TexelSizes texelSizes(const SurfacePoints& points, const View& view, std::span<const ShadowFit> fits,
                      const std::vector<std::uint8_t>& marked);

}  // namespace umbriel
