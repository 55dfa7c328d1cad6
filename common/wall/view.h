#pragma once

#include <cstdint>
#include <vector>

#include "common/math/glm.h"
#include "common/scene/cameras.h"
#include "common/scene/windows.h"
#include "common/math/pixel_rect.h"

namespace umbriel {

// How a server draws its part of the wall so that the parts fit together (docs/architecture.md, seams).
//   Exact:  into a wall-sized target in wall window coordinates, scissored to the tile: bit-equal on servers of one
//           renderer. Memory and size limit are those of the whole wall.
//   Offset: into a tile-sized target under a wall-sized viewport moved by the tile's origin: no holes, last bits differ.
enum class TileMode : std::uint32_t { Exact, Offset };

// What the servers send back per pixel; bits of a mask.
enum class Layer : std::uint32_t {
    Colour = 1,         // linear RGBA, associated alpha
    Depth = 2,          // distance from the eye along the view axis, metres; 0 where nothing was drawn
    Position = 4,       // world position relative to the view's eye, metres (the world's axes)
    Normal = 8,         // geometric normal, world axes, facing the viewer
    Ids = 16,           // low 32 bits of the node's id, triangle within the geometry; 0xffffffff where nothing is
    LightFactors = 32,  // one channel per light of the plan: the share of its light that arrives
};

// What colours are drawn into, and sent back in: the servers' costs and the bytes of a frame follow it. Depths,
// positions and light factors are of 32 bits whatever this says.
//   Float: 32 bits a channel.
//   Half:  16: 11 significant bits from 6.1e-5 to 65504, steps of 6e-8 below; more becomes the largest or infinity,
//          as the driver rounds.
//   Byte:  8, linear, clamped to [0, 1]: what classical renderers draw into. The least step from black is shown as sRGB
//          code 13, so darks have bands.
enum class ColourPrecision : std::uint32_t { Float, Half, Byte };

// How a map of a light is laid out. A light has one map, or six, or two: part tells them apart.
//   Single:     one projective map.
//   CubeFace:   all around a point; part 0..5 looks along +x, -x, +y, -y, +z, -z of the world.
//   Hemisphere: all around a point by two paraboloids (Brabec et al. 2002); part 0 looks along the light's -z, 1 along +z.
enum class ShadowShape : std::uint32_t { Single, CubeFace, Hemisphere };

// Which casters a map is drawn of, beside a light map (module LightMap): those whose shadows are in it, or the others,
// which move.
enum class ShadowCasters : std::uint32_t { All, Fixed, Moving };

// How a map is filtered (modules PCF and PPCF).
struct ShadowFilter {
    float widthTexels = 0.0f;             // of the filter, side to side
    float widthMetres = 0.0f;             // where positive, this width instead
    std::uint32_t samplesPerRow = 0;      // PCF: at most so many samples along each side; 0: as many as texels
    std::uint32_t blockerSamples = 0;     // PPCF: along each side of the search for blockers
    std::uint32_t filterSamples = 0;      // PPCF: along each side of the filter, at most
    float lightSize = 0.0f;               // PPCF: metres across; of a directional light: metres of penumbra per metre
    float maxTexels = 0.0f;               // PPCF: no penumbra is wider
    bool nearestBlocker = false;          // PPCF: not the mean of the blockers, but the one nearest to the light
    bool bilinear = false;                // each sample is the mix of its four nearest texels
    std::uint32_t boundsBlock = 0;        // texels a side of the blocks whose bounds let samples be skipped; 0: none
    friend bool operator==(const ShadowFilter&, const ShadowFilter&) = default;
};

// The fit of one light's shadow for one module, computed on the client in double over everything any tile or eye sees,
// so that all servers build the same map. Modules without a map (volumes, planar) use the light's place and nothing of
// the map.
//
// A map's clip space: x and y of [-w, w] fill the map. w may vary over the map (a warp: LISP, trapezoid, PSM): for a
// directional light it depends on the place across the light only, for a perspective one on the direction from it, so
// that a ray of light stays one point of the map. z is never warped: z over w of the same light's unwarped map is the
// depth, in [0, 1], 1 nearest the light; linear in metres for a directional light.
struct ShadowFit {
    ContainerId light;
    ShadowMode mode = ShadowMode::None;   // the module
    ShadowShape shape = ShadowShape::Single;
    std::uint32_t part = 0;
    std::uint32_t mapSize = 0;            // texels along each side; 0: no map
    bool perspective = false;             // the light stands somewhere: depth is not linear
    glm::dmat3 worldFromLight{1.0};       // the light's axes, orthonormal; it shines along -z
    glm::dvec3 positionWorld{0.0};        // metres; of a perspective light
    glm::dmat4 clipFromWorld{1.0};
    double texelSize = 0.0;               // metres covered by a texel (directional), at unit distance (perspective);
                                          // under a warp: of the largest texel
    double depthRange = 0.0;              // metres between depth 1 and depth 0
    float constantBias = 0.0f;            // in texels along the light's direction
    float slopeBias = 0.0f;               // polygon-offset factor
    float normalOffset = 0.0f;            // in texels above the receiver's plane
    ShadowFilter filter;
    glm::dvec4 planeWorld{0.0};           // planar modules: unit normal, offset; normal . point + offset = 0
    float blobSize = 1.0f;                // blobs: of the object's radius
    ShadowCasters casters = ShadowCasters::All;
    std::uint32_t layer = 0;              // light maps: of the viewport's light map
    friend bool operator==(const ShadowFit&, const ShadowFit&) = default;
};

// One eye's look through one viewport: what used to be a camera, with everything resolved.
struct View {
    ContainerId viewport;
    Eye eye = Eye::Mono;
    PixelRect region;                // of the viewport on the wall
    glm::dvec3 eyeWorld{0.0};        // metres; geometry is uploaded relative to it
    glm::dmat3 viewFromWorld{1.0};   // rotation only
    glm::dmat4 clipFromView{1.0};    // of the whole region; reversed depth: 1 at the near plane, 0 at infinity or far
    double nearDistance = 0.1;       // metres
    bool orthographic = false;
    // No look at all, but all surfaces side by side, both sides of each, where their TEXCOORD_1 puts them: clipFromView
    // is then of (u, v, 0, 1). For light maps that are baked of light factors; such a view has no colours.
    bool unwrapped = false;
    std::vector<ShadowFit> fits;     // by light, ascending by id
};

// Everything about a frame that is not scene: the same for all servers, sent when it changes.
struct WallViews {
    PixelSize wall;                  // pixels of the whole wall
    TileMode tiles = TileMode::Offset;
    std::uint32_t samples = 1;       // 1 or 4 per pixel
    std::uint32_t layers = static_cast<std::uint32_t>(Layer::Colour);
    ColourPrecision colourPrecision = ColourPrecision::Float;
    std::vector<View> views;         // back to front
};

// The part of the wall a server draws; a server may have several (fewer servers than tiles).
struct TileAssignment {
    std::uint32_t tile = 0;          // index in the grid, row by row from the lower left
    PixelRect pixels;                // on the wall, origin at the lower left
    Eye eye = Eye::Mono;             // views of other eyes are not drawn here
};

}  // namespace umbriel
