#include "server/draw/tile_pieces.h"

#include <cstring>
#include <utility>

#include "common/base/assert.h"

namespace umbriel {
namespace {

bool isInside(const PixelRect& piece, const PixelRect& tile) { return intersect(piece, tile) == piece; }

void copyInto(const TileLayer& piece, const PixelRect& pieceRect, TileLayer& tile, const PixelRect& tileRect) {
    const std::size_t pixelBytes = bytesOf(piece.components) * piece.channels;
    const std::size_t rowBytes = pixelBytes * static_cast<std::size_t>(pieceRect.width);
    for (std::int32_t row = 0; row < pieceRect.height; ++row) {
        const auto y = static_cast<std::size_t>(pieceRect.y - tileRect.y + row);
        const std::size_t to = pixelBytes * (y * static_cast<std::size_t>(tileRect.width) +
                                             static_cast<std::size_t>(pieceRect.x - tileRect.x));
        std::memcpy(tile.pixels.data() + to, piece.pixels.data() + rowBytes * static_cast<std::size_t>(row), rowBytes);
    }
}

}  // namespace

std::vector<TileAssignment> piecesOf(std::span<const TileAssignment> tiles, std::int32_t side) {
    UMBRIEL_ASSERT(side > 0, "pieces have a size");
    std::vector<TileAssignment> pieces;
    for (const TileAssignment& tile : tiles) {
        const PixelRect& all = tile.pixels;
        for (std::int32_t y = all.y / side * side; y < all.y + all.height; y += side)
            for (std::int32_t x = all.x / side * side; x < all.x + all.width; x += side) {
                pieces.push_back(tile);
                pieces.back().pixels = intersect(all, {x, y, side, side});
            }
    }
    return pieces;
}

std::vector<TilePixels> joinPieces(std::vector<TilePixels> pieces, std::span<const TileAssignment> tiles) {
    std::vector<TilePixels> joined;
    std::size_t next = 0;
    for (const TileAssignment& tile : tiles) {
        UMBRIEL_ASSERT(next < pieces.size(), "every tile has its pieces");
        if (pieces[next].tile.pixels == tile.pixels) {
            joined.push_back(std::move(pieces[next++]));
            continue;
        }
        TilePixels whole;
        whole.tile = tile;
        for (; next < pieces.size() && pieces[next].tile.tile == tile.tile && isInside(pieces[next].tile.pixels, tile.pixels); ++next) {
            const TilePixels& piece = pieces[next];
            if (whole.layers.empty()) {
                for (const TileLayer& layer : piece.layers) {
                    TileLayer& made = whole.layers.emplace_back();
                    made.layer = layer.layer;
                    made.name = layer.name;
                    made.channels = layer.channels;
                    made.components = layer.components;
                    made.pixels.resize(static_cast<std::size_t>(tile.pixels.area()) * layer.channels *
                                       bytesOf(layer.components));
                }
            }
            for (std::size_t i = 0; i < piece.layers.size(); ++i)
                copyInto(piece.layers[i], piece.tile.pixels, whole.layers[i], tile.pixels);
        }
        joined.push_back(std::move(whole));
    }
    return joined;
}

}  // namespace umbriel
