#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/wall/view.h"

namespace umbriel {

// One layer of a drawn tile: rows bottom-up as GL reads them back, pixels interleaved, 4 bytes a channel.
struct TileLayer {
    Layer layer = Layer::Colour;
    std::string name;               // "colour", "depth", "position", "normal", "ids", "light.<name or id>"
    std::uint32_t channels = 4;
    bool isInteger = false;         // ids: unsigned 32-bit, else float
    std::vector<std::byte> pixels;  // width * height * channels * 4
};

struct TilePixels {
    TileAssignment tile;
    std::vector<TileLayer> layers;
};

}  // namespace umbriel
