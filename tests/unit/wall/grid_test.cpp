#include "common/wall/grid.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>

namespace umbriel {
namespace {

TEST(Grid, ColumnsAndRowsAreFlooredFromTheLowerLeft) {
    const auto tiles = gridTiles({1277, 719}, 5, 3);
    ASSERT_TRUE(tiles);
    ASSERT_EQ(tiles->size(), 15u);
    EXPECT_EQ((*tiles)[0].pixels, (PixelRect{0, 0, 255, 239}));
    EXPECT_EQ((*tiles)[1].pixels, (PixelRect{255, 0, 255, 239}));
    EXPECT_EQ((*tiles)[5].pixels, (PixelRect{0, 239, 255, 240}));
    EXPECT_EQ((*tiles)[14].pixels, (PixelRect{1021, 479, 256, 240}));
    for (std::size_t i = 0; i < tiles->size(); ++i) EXPECT_EQ((*tiles)[i].tile, i);
}

// Every pixel in exactly one tile, no tile empty, sizes that differ by at most one.
RC_GTEST_PROP(Grid, TilesPartitionTheWall, ()) {
    const PixelSize wall{*rc::gen::inRange(1, 65537), *rc::gen::inRange(1, 65537)};
    const int columns = *rc::gen::inRange(1, std::min(wall.width, 200) + 1);
    const int rows = *rc::gen::inRange(1, std::min(wall.height, 200) + 1);
    const auto tiles = gridTiles(wall, columns, rows);
    RC_ASSERT(tiles.has_value());
    RC_ASSERT(tiles->size() == static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    std::int64_t area = 0;
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) {
            const PixelRect& tile = (*tiles)[static_cast<std::size_t>(row * columns + column)].pixels;
            RC_ASSERT(tile.width >= wall.width / columns && tile.width <= wall.width / columns + 1);
            RC_ASSERT(tile.height >= wall.height / rows && tile.height <= wall.height / rows + 1);
            area += tile.area();
            if (column > 0) {
                const PixelRect& left = (*tiles)[static_cast<std::size_t>(row * columns + column - 1)].pixels;
                RC_ASSERT(left.x + left.width == tile.x);
            }
            if (row > 0) {
                const PixelRect& below = (*tiles)[static_cast<std::size_t>((row - 1) * columns + column)].pixels;
                RC_ASSERT(below.y + below.height == tile.y);
            }
        }
    RC_ASSERT(area == std::int64_t{wall.width} * wall.height);
}

TEST(Grid, ImpossibleWallsAndGridsAreRefused) {
    const auto refused = [](PixelSize wall, std::int64_t columns, std::int64_t rows) {
        const auto tiles = gridTiles(wall, columns, rows);
        return tiles.has_error() && tiles.error().kind == Error::Kind::BadInput && !tiles.error().message.empty();
    };
    constexpr std::int64_t kHuge = std::numeric_limits<std::int64_t>::max();
    EXPECT_TRUE(refused({0, 10}, 1, 1));
    EXPECT_TRUE(refused({10, -1}, 1, 1));
    EXPECT_TRUE(refused({65537, 10}, 1, 1));
    EXPECT_TRUE(refused({10, 10}, 0, 1));
    EXPECT_TRUE(refused({10, 10}, 1, -2));
    EXPECT_TRUE(refused({10, 10}, 11, 1));
    EXPECT_TRUE(refused({10, 10}, 1, 11));
    EXPECT_TRUE(refused({10, 10}, kHuge, kHuge));
    EXPECT_TRUE(refused({65536, 65536}, 65536, 65536));
    EXPECT_FALSE(refused({65536, 1}, 65536, 1));
    EXPECT_FALSE(checkedWallSize(kHuge, 5));
}

RC_GTEST_PROP(Grid, ServersShareTheTilesRoundRobin, ()) {
    const auto tiles = gridTiles({640, 480}, *rc::gen::inRange(1, 9), *rc::gen::inRange(1, 9));
    const auto servers = static_cast<std::size_t>(*rc::gen::inRange(1, 20));
    std::vector<int> seen(tiles->size(), 0);
    std::size_t fewest = tiles->size(), most = 0;
    const auto dealt = dealTiles(*tiles, servers);
    RC_ASSERT(dealt.size() == servers);
    for (const auto& own : dealt) {
        fewest = std::min(fewest, own.size());
        most = std::max(most, own.size());
        for (const TileAssignment& tile : own) ++seen[tile.tile];
    }
    for (int count : seen) RC_ASSERT(count == 1);
    RC_ASSERT(most - fewest <= 1);
}

}  // namespace
}  // namespace umbriel
