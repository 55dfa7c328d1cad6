#pragma once

#include <algorithm>
#include <span>

#include "common/image/image.h"

namespace umbriel {

// Copies a tile as OpenGL reads it back (bottom row first, `tileChannels` interleaved values per pixel, tightly packed)
// into its place in a whole-wall picture (top row first). `tile` is in wall pixels with the origin at the lower left,
// as glViewport and glReadPixels count. The first wall.channelCount() values of each pixel are kept, so an RGBA
// attachment may carry a layer of three channels. Bits are moved, not computed with.
//
// Sizes and places are the caller's to have checked: a tile outside the wall is a programming error.
template <class T>
void copyTile(std::span<const T> tileSamples, int tileChannels, const PixelRect& tile, BasicImage<T>& wall) {
    UMBRIEL_ASSERT(tile.x >= 0 && tile.y >= 0 && tile.width >= 0 && tile.height >= 0 &&
                       tile.width <= wall.width() - tile.x && tile.height <= wall.height() - tile.y,
                   "a tile reaches outside the wall");
    UMBRIEL_ASSERT(tileChannels >= wall.channelCount(), "a tile has fewer channels than the wall");
    const auto width = static_cast<std::size_t>(tile.width);
    const auto stride = static_cast<std::size_t>(tileChannels);
    UMBRIEL_ASSERT(tileSamples.size() == width * static_cast<std::size_t>(tile.height) * stride,
                   "a tile's samples do not fill its rectangle");
    if (tile.width == 0 || tile.height == 0) {
        return;
    }
    const auto kept = static_cast<std::size_t>(wall.channelCount());
    for (int row = 0; row < tile.height; ++row) {
        const T* from = tileSamples.data() + static_cast<std::size_t>(row) * width * stride;
        T* to = wall.pixel(tile.x, wall.height() - 1 - (tile.y + row));
        if (stride == kept) {
            std::copy_n(from, width * kept, to);
        } else {
            for (std::size_t x = 0; x < width; ++x) {
                std::copy_n(from + x * stride, kept, to + x * kept);
            }
        }
    }
}

}  // namespace umbriel
