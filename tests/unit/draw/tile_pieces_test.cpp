#include "server/draw/tile_pieces.h"

#include <gtest/gtest.h>

#include <cstring>

namespace umbriel {
namespace {

TileAssignment tileOf(std::uint32_t index, const PixelRect& pixels) { return {index, pixels, Eye::Mono}; }

// A picture in which every pixel says where it is on the wall.
TilePixels pictureOf(const TileAssignment& tile) {
    TilePixels picture;
    picture.tile = tile;
    TileLayer& layer = picture.layers.emplace_back();
    layer.channels = 2;
    for (std::int32_t y = 0; y < tile.pixels.height; ++y)
        for (std::int32_t x = 0; x < tile.pixels.width; ++x) {
            const float place[2] = {static_cast<float>(tile.pixels.x + x), static_cast<float>(tile.pixels.y + y)};
            const auto bytes = std::as_bytes(std::span(place));
            layer.pixels.insert(layer.pixels.end(), bytes.begin(), bytes.end());
        }
    return picture;
}

TEST(TilePieces, SmallTilesStayWhole) {
    const std::vector<TileAssignment> tiles{tileOf(0, {0, 0, 100, 50}), tileOf(1, {100, 0, 100, 50})};
    EXPECT_EQ(piecesOf(tiles, 200).size(), 2u);
    EXPECT_EQ(joinPieces({pictureOf(tiles[0]), pictureOf(tiles[1])}, tiles)[1].layers[0].pixels, pictureOf(tiles[1]).layers[0].pixels);
}

TEST(TilePieces, PiecesOfAnyTilesJoinToTheTiles) {
    for (const std::int32_t side : {1, 3, 8, 64}) {
        const std::vector<TileAssignment> tiles{tileOf(0, {0, 0, 13, 7}), tileOf(1, {13, 0, 20, 7}), tileOf(2, {0, 7, 33, 9})};
        std::vector<TilePixels> pictures;
        for (const TileAssignment& piece : piecesOf(tiles, side)) {
            EXPECT_LE(piece.pixels.width, side);
            EXPECT_LE(piece.pixels.height, side);
            EXPECT_FALSE(piece.pixels.empty());
            pictures.push_back(pictureOf(piece));
        }
        const auto joined = joinPieces(std::move(pictures), tiles);
        ASSERT_EQ(joined.size(), tiles.size());
        for (std::size_t i = 0; i < tiles.size(); ++i) {
            EXPECT_EQ(joined[i].tile.pixels, tiles[i].pixels);
            EXPECT_EQ(joined[i].layers[0].pixels, pictureOf(tiles[i]).layers[0].pixels) << "side " << side;
        }
    }
}

TEST(TilePieces, PixelsOfFewBytesJoinToo) {
    for (const ComponentType type : {ComponentType::Half, ComponentType::Byte}) {
        const auto picture = [&](const TileAssignment& tile) {
            TilePixels made;
            made.tile = tile;
            TileLayer& layer = made.layers.emplace_back();
            layer.components = type;
            for (std::int32_t y = 0; y < tile.pixels.height; ++y)
                for (std::int32_t x = 0; x < tile.pixels.width; ++x)
                    for (std::size_t i = 0; i < 4 * bytesOf(type); ++i)
                        layer.pixels.push_back(static_cast<std::byte>(16 * (tile.pixels.y + y) + tile.pixels.x + x));
            return made;
        };
        const std::vector<TileAssignment> tiles{tileOf(0, {0, 0, 13, 7})};
        std::vector<TilePixels> pieces;
        for (const TileAssignment& piece : piecesOf(tiles, 3)) pieces.push_back(picture(piece));
        const auto joined = joinPieces(std::move(pieces), tiles);
        EXPECT_EQ(joined.at(0).layers.at(0).components, type);
        EXPECT_EQ(joined[0].layers[0].pixels, picture(tiles[0]).layers[0].pixels);
    }
}

}  // namespace
}  // namespace umbriel
