#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "client/trade/shadow_scene.h"
#include "client/trade/surface_points.h"

namespace umbriel {

// How finely true shadows are traced.
struct TruthOptions {
    // Rays to an area light: a square of strata, jittered by the pixel's number. Where those on the rim and a ninth of
    // the others (85 of 16 x 16) agree, the rest are not traced.
    int lightSamplesPerSide = 16;
    int threads = 0;  // 0: all processors; the result does not depend on it
};

// The share of the light that arrives at each surface point (1 all, 0 none), by rays from the very point the renderer
// shaded, put back onto the plane of its triangle in double; that triangle is skipped. A light without a radius gets
// one ray, another lightSamplesPerSide^2 over the disc that faces the point, all weighing the same. 1 in the background
// and for a light that casts no shadow.
std::vector<float> shadowTruth(const ShadowScene& scene, const SurfacePoints& points, std::size_t light,
                               const TruthOptions& options = {});

// Which pixels errors are counted in.
struct JudgedOptions {
    double smallestCosine = 0.1;                      // of the angle between geometric normal and light
    bool bothSides = false;                           // a light behind the surface is judged as if it shone through
    const std::vector<std::uint8_t>* only = nullptr;  // nodes' own mask, by pixel; null: all
};
// 1 where a pixel of this light is judged: covered, the light above it in the scene graph and within range and cone,
// facing it, and not on a silhouette (silhouettes()).
std::vector<std::uint8_t> judgedPixels(const ShadowScene& scene, const SurfacePoints& points, std::size_t light,
                                       const std::vector<std::uint8_t>& silhouette, const JudgedOptions& options = {});

// 1 for pixels of the given nodes (low 32 bits).
std::vector<std::uint8_t> pixelsOf(const SurfacePoints& points, const std::vector<std::uint32_t>& nodes);

// Of the pixels where result and truth are on different sides of 1/2, those where no edge of the true shadow passes
// within `texels` texels of the map on the receiver's plane: acne and leaks that no map of this size excuses. `fits`:
// of this light, more than one around it. Probed by 32 rays each, or more where texels reach far.
struct BeyondTexel {
    std::uint64_t leaks = 0;
    std::uint64_t acne = 0;
};
BeyondTexel beyondTexel(const ShadowScene& scene, const SurfacePoints& points, std::size_t light,
                        std::span<const ShadowFit> fits, const std::vector<float>& truth,
                        const std::vector<float>& result, const std::vector<std::uint8_t>& judged, double texels = 1.0,
                        int threads = 0);

}  // namespace umbriel
