#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "common/wall/tile_pixels.h"

namespace umbriel {

// The last picture of every tile: a tile whose server is late or lost keeps it.
class HeldTiles {
 public:
    void take(std::vector<TilePixels> fresh) {
        for (TilePixels& tile : fresh) {
            const auto held = std::find_if(_tiles.begin(), _tiles.end(),
                                           [&](const TilePixels& one) { return one.tile.tile == tile.tile.tile; });
            if (held == _tiles.end())
                _tiles.push_back(std::move(tile));
            else
                *held = std::move(tile);
        }
    }
    // The wall was cut anew.
    void clear() { _tiles.clear(); }
    const std::vector<TilePixels>& all() const { return _tiles; }

 private:
    std::vector<TilePixels> _tiles;
};

}  // namespace umbriel
