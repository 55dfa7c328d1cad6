#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "client/bake/light_map_charts.h"
#include "common/base/result.h"
#include "common/math/affine.h"
#include "common/trace/occlusion.h"

namespace umbriel {

// A surface to be baked.
struct LightMapSurface {
    ChartMesh mesh;
    Affine worldFromObject;
    std::vector<glm::dvec3> objectPositions;  // by vertex, metres; of these world positions
    std::vector<std::uint32_t> rayTriangles;  // by triangle: its number for the rays
    std::vector<std::uint8_t> lit;            // by light: 1 when it reaches the surface
};

// A light whose factors are baked.
struct LightMapLight {
    bool isDirectional = true;
    glm::dvec3 positionWorld{0.0};
    glm::dvec3 directionWorld{0, 0, -1};  // the way it travels
    double radius = 0.0;                  // metres; directional: radians; 0: hard shadows
};

// How finely a light map is baked, and by how many threads.
struct LightMapOptions {
    std::uint32_t size = 1024;  // texels along each side
    int samples = 4;            // points along each side of a texel, 1 to 16
    int lightSamples = 2;       // rays along each side of a light with a size, from each point, 1 to 16
    int threads = 0;            // 0: all; the result does not depend on it
    std::function<void(std::uint64_t, std::uint64_t)> progress{};  // parts done and in all; by the caller's thread
};

// The fields of LightMap (common/scene/light_map.h) but what they were baked of.
struct BakedLightMap {
    std::uint32_t size = 0;
    std::vector<std::uint8_t> texels;      // light after light
    std::vector<std::uint32_t> triangles;  // by surface
    std::vector<std::uint32_t> places;
    std::vector<glm::vec4> charts;
    std::uint64_t covered = 0;     // texels that hold some surface
    std::uint32_t chartCount = 0;  // that lie apart in the atlas
    std::uint64_t rays = 0;
    std::uint64_t lookups = 0;  // points on a surface whose factors were drawn
    double texelMetres = 0.0;   // the side of a texel of the largest chart
};

// Who draws the factors of all lights in texture space, in place of rays.
class LightMapDrawer {
 public:
    virtual ~LightMapDrawer() = default;
    // Once, before anything is looked up: where the corners of all triangles lie in the atlas, in texels; by surface,
    // three a triangle. Those of a triangle that is in no chart lie at the origin, all three.
    virtual Result<void> unwrap(std::vector<std::vector<glm::dvec2>> corners, std::uint32_t size) = 0;
    // The factors at the middles of samples x samples parts of each texel of a square of the atlas, which may reach
    // beyond it: by light, rows upwards. Negative: no surface lies there.
    virtual Result<std::vector<std::vector<float>>> lookUp(std::uint32_t x, std::uint32_t y, std::uint32_t side,
                                                           int samples) = 0;
};

// Points that a drawer looks up along each side at once: their factors are 16 MiB a light.
inline constexpr std::uint32_t kDrawnPoints = 2048;

// A texel's factor is the share of the light that arrives at its part of the surface: at samples x samples points of
// the texel (those that the surface covers), by rays from the surface itself, towards the light's middle or, of a light
// with a size, over its disc. Texels of a chart that hold no surface take the mean of their neighbours, outwards from
// those that do, and no look-up reaches texels of another chart: what is looked up between texels leaks nothing.
//
// With a drawer it is the mean of what that finds at the same points; rays say what charts are so thin that none of
// their points is drawn.
//
// Bad input: an atlas too small for the charts. Failure: out of memory is not caught; what the drawer says.
Result<BakedLightMap> bakeLightMap(std::span<const LightMapSurface> surfaces, std::span<const LightMapLight> lights,
                                   const trace::OcclusionScene& rays, const LightMapOptions& options,
                                   LightMapDrawer* drawer = nullptr);

}  // namespace umbriel
