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

// The fit of one light's shadow map, computed on the client in double over everything any tile or eye sees, so that all
// servers build the same map.
struct ShadowFit {
    ContainerId light;
    ShadowMode mode = ShadowMode::None;
    std::uint32_t mapSize = 0;            // texels along each side
    bool perspective = false;             // a spot light's map: depth is not linear
    glm::dmat4 clipFromWorld{1.0};        // xy in [-1,1], reversed depth z in [0,1] (1 nearest the light)
    double texelSize = 0.0;               // metres covered by a texel (directional), at unit distance (perspective)
    double depthRange = 0.0;              // metres between depth 1 and depth 0 (directional)
    float constantBias = 0.0f;            // in texels along the light's direction
    float slopeBias = 0.0f;               // polygon-offset factor
    float normalOffset = 0.0f;            // in texels along the geometric normal
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
    std::vector<ShadowFit> fits;     // by light, ascending by id
};

// Everything about a frame that is not scene: the same for all servers, sent when it changes.
struct WallViews {
    PixelSize wall;                  // pixels of the whole wall
    TileMode tiles = TileMode::Offset;
    std::uint32_t samples = 1;       // 1 or 4 per pixel
    std::uint32_t layers = static_cast<std::uint32_t>(Layer::Colour);
    std::vector<View> views;         // back to front
};

// The part of the wall a server draws; a server may have several (fewer servers than tiles).
struct TileAssignment {
    std::uint32_t tile = 0;          // index in the grid, row by row from the lower left
    PixelRect pixels;                // on the wall, origin at the lower left
    Eye eye = Eye::Mono;             // views of other eyes are not drawn here
};

}  // namespace umbriel
