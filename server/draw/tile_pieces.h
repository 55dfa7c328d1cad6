#pragma once

#include <span>
#include <vector>

#include "common/wall/tile_pixels.h"

namespace umbriel {

// Tiles larger than a texture can be are drawn in pieces and put together after they were read back.

// The tiles in order, each cut where the wall's coordinates are multiples of side: no piece is larger than side x side.
std::vector<TileAssignment> piecesOf(std::span<const TileAssignment> tiles, std::int32_t side);

// The pictures of the pieces, in the order of piecesOf(), as pictures of the tiles.
std::vector<TilePixels> joinPieces(std::vector<TilePixels> pieces, std::span<const TileAssignment> tiles);

}  // namespace umbriel
