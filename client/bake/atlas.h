#pragma once

#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "common/image/image.h"
#include "common/visibility/map_file.h"
#include "common/visibility/mesh.h"

namespace umbriel {

// Visibility maps as a picture (OpenEXR through writeExr()), for eyes and for other programs. Each row of the file is a
// tile, tiles lie from left to right and from the top down. R, G, B are 1 where a pixel is open and 0 where it is
// blocked; A is 0 where a tile has no pixel. Distances and hit distances are the layers "distance" and "hit" (channel
// V; radians, shares of the diagonal), index maps the layer "index" (UINT, channel V). What the header of the file says
// is in text attributes that begin with "umvis".
struct AtlasOptions {
    std::vector<std::uint64_t> rows;  // which rows; empty: all of the file
    std::uint32_t columns = 0;        // tiles beside each other; 0: about a square
    // R, G, B are the absolute distance over pi/2 instead: dark along the silhouette, bright away from it.
    bool showDistance = false;
};

// Where a pixel lies in its tile, counted from the lower left: the sides of a HemiCube hang on the edges of the top
// image, those of a Cube stand in a row between top and bottom.
struct TilePlace {
    int x = 0;
    int y = 0;
};
TilePlace tileSize(const visibility::Mapping& mapping);
TilePlace tilePlace(const visibility::Mapping& mapping, std::uint32_t pixel);

// Bad input: rows that are not in the file, distances that it does not hold, more than 2^28 pixels in all.
Result<LayeredImage> exportAtlas(const visibility::MapFile& file, const AtlasOptions& options = {});

// The file back from an atlas of all rows: the same bytes as it was made from. Bad input: not such a picture, one that
// shows distances, another mesh, other directions, values that no bake makes (a lossy compression, another program).
Result<visibility::Bytes> importAtlas(const LayeredImage& picture, const visibility::BakeMesh& mesh);

}  // namespace umbriel
