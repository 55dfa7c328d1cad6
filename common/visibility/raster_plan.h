#pragma once

#include <cstdint>
#include <vector>

#include "common/math/glm.h"
#include "common/visibility/mapping.h"

namespace umbriel::visibility {

// One perspective picture of a map: what lies at depth w along `out` and at (x w, y w) along the other two axes comes
// to (x, y) of the window. Texel centres look where the pixels of the mappings look.
struct RasterView {
    glm::dvec3 out{0, 0, 1}, along{1, 0, 0}, up{0, 1, 0};  // orthonormal, in the mapping's frame
    double x0 = -1, x1 = 1, y0 = -1, y1 = 1;               // the window, on the plane at depth 1
    std::uint32_t width = 0, height = 0;                   // texels
    std::uint32_t bottom = 0;                              // first row in the tile; views lie above each other
    // Seen from the side away from the normal (DirectionSide::Own).
    bool lower = false;
};

// How a rasteriser makes the map of one vertex: its views, drawn into one tile, and for each pixel the texel of the
// tile (y * width + x) that it copies. HemiCube, SinglePlane and Cube are drawn as they are. The others are not linear
// in homogeneous space and are copied by table (Ganster 2002, 2.2.3): HemiSphere and Fibonacci from a HemiCube,
// Octahedral from a cube in the axes of the mesh. Its texels are at most a third of a pixel of HemiSphere wide, so that
// what a pixel copies was seen within a quarter of its width from its centre.
struct RasterPlan {
    std::vector<RasterView> views;
    std::uint32_t width = 0, height = 0;  // of the tile
    std::vector<std::uint32_t> texel;     // for each pixel
    // Whether the eye must stay clear of the own triangles on all sides, not of those above it only.
    bool allAround = false;
};
RasterPlan rasterPlan(const Mapping& mapping);

}  // namespace umbriel::visibility
