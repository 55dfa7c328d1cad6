#include "common/image/assemble.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstring>
#include <random>
#include <vector>

#include "tests/unit/image/test_files.h"

namespace umbriel {
namespace {

TEST(Assemble, LowerLeftTileLandsInTheBottomRows) {
    FloatImage wall(3, 3, {"Z"});
    const std::vector<float> tile{1, 2, 3, 4};  // bottom row 1 2, top row 3 4
    copyTile<float>(tile, 1, {0, 0, 2, 2}, wall);
    EXPECT_EQ(wall.samples(), (std::vector<float>{0, 0, 0, 3, 4, 0, 1, 2, 0}));
}

TEST(Assemble, ExtraChannelsOfTheAttachmentAreLeftOut) {
    UintImage wall(2, 1, {"node", "primitive"});
    const std::vector<std::uint32_t> tile{1, 2, 9, 9, 3, 4, 9, 9};
    copyTile<std::uint32_t>(tile, 4, {0, 0, 2, 1}, wall);
    EXPECT_EQ(wall.samples(), (std::vector<std::uint32_t>{1, 2, 3, 4}));
}

TEST(Assemble, EmptyTileChangesNothing) {
    FloatImage wall(2, 2, {"Z"}, 7.0F);
    copyTile<float>({}, 1, {2, 0, 0, 2}, wall);
    EXPECT_EQ(wall.samples(), std::vector<float>(4, 7.0F));
}

// Cutting a bottom-up picture by the rule of --grid and putting it together again gives the picture, every bit of it.
RC_GTEST_PROP(Assemble, TilesOfAWallMakeTheWall, ()) {
    const int width = *rc::gen::inRange(1, 24);
    const int height = *rc::gen::inRange(1, 24);
    const int columns = *rc::gen::inRange(1, width + 1);
    const int rows = *rc::gen::inRange(1, height + 1);
    std::mt19937_64 random(*rc::gen::arbitrary<std::uint64_t>());
    FloatImage truth = makeRgbaImage(width, height);
    test::fillWithAnyBits(truth, random);
    FloatImage wall = makeRgbaImage(width, height);
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const int x = column * width / columns;
            const int y = row * height / rows;
            const PixelRect rect{x, y, (column + 1) * width / columns - x, (row + 1) * height / rows - y};
            std::vector<float> tile(static_cast<std::size_t>(rect.width * rect.height) * 4);
            for (int r = 0; r < rect.height; ++r) {
                std::memcpy(&tile[static_cast<std::size_t>(r * rect.width) * 4],
                            truth.pixel(rect.x, height - 1 - (rect.y + r)),
                            static_cast<std::size_t>(rect.width) * 4 * sizeof(float));
            }
            copyTile<float>(tile, 4, rect, wall);
        }
    }
    RC_ASSERT(test::sameBits(truth, wall));
}

TEST(AssembleDeathTest, TileOutsideTheWallIsRefused) {
    FloatImage wall(2, 2, {"Z"});
    const std::vector<float> tile(4);
    EXPECT_DEATH(copyTile<float>(tile, 1, {1, 0, 2, 2}, wall), "outside the wall");
    EXPECT_DEATH(copyTile<float>(tile, 1, {0, -1, 2, 2}, wall), "outside the wall");
    EXPECT_DEATH(copyTile<float>(tile, 1, {2147483647, 0, 2, 2}, wall), "outside the wall");
    EXPECT_DEATH(copyTile<float>(tile, 1, {0, 0, 2, 1}, wall), "fill its rectangle");
    EXPECT_DEATH(copyTile<float>(tile, 0, {0, 0, 2, 2}, wall), "fewer channels");
}

TEST(Image, TurningARectangleOverTwiceGivesIt) {
    const PixelRect rect{1, 2, 3, 4};
    EXPECT_EQ(turnedOver(rect, 10), (PixelRect{1, 4, 3, 4}));
    EXPECT_EQ(turnedOver(turnedOver(rect, 10), 10), rect);
}

}  // namespace
}  // namespace umbriel
