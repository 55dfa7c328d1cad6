#pragma once

#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "common/math/pixel_rect.h"
#include "common/wall/view.h"

namespace umbriel {

// Pixels along a side of a wall; GL viewports and our 16-bit-friendly pixel arithmetic end well above it.
inline constexpr std::int64_t kMaxWallSide = 65536;
inline constexpr std::int64_t kMaxTiles = 65536;

// An error saying what is wrong when a wall cannot have this size: 1..kMaxWallSide pixels along each side.
Result<PixelSize> checkedWallSize(std::int64_t width, std::int64_t height);

// The tiles of a flat wall, `--grid CxR`: column i covers pixels floor(i W / C) .. floor((i+1) W / C), rows likewise
// from the bottom; row by row from the lower left, which is tile 0. An error for impossible sizes, grids without tiles
// or with more columns than pixels.
Result<std::vector<TileAssignment>> gridTiles(PixelSize wall, std::int64_t columns, std::int64_t rows);

// Round robin: the tiles of each of these servers, at least one, in order; of some none where there are more servers
// than tiles.
std::vector<std::vector<TileAssignment>> dealTiles(const std::vector<TileAssignment>& tiles, std::size_t servers);

}  // namespace umbriel
