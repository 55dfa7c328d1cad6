#include "common/wall/grid.h"

#include <fmt/format.h>

#include "common/base/assert.h"

namespace umbriel {

Result<PixelSize> checkedWallSize(std::int64_t width, std::int64_t height) {
    if (width < 1 || height < 1 || width > kMaxWallSide || height > kMaxWallSide)
        return badInput(fmt::format("a wall of {}x{} pixels is impossible: each side must be 1 to {}", width, height,
                                    kMaxWallSide));
    return PixelSize{static_cast<std::int32_t>(width), static_cast<std::int32_t>(height)};
}

Result<std::vector<TileAssignment>> gridTiles(PixelSize wall, std::int64_t columns, std::int64_t rows) {
    const auto size = checkedWallSize(wall.width, wall.height);
    if (size.has_error()) return size.error();
    if (columns < 1 || rows < 1)
        return badInput(
            fmt::format("a grid of {}x{} has no tiles: it needs at least one column and one row", columns, rows));
    if (columns > wall.width || rows > wall.height)
        return badInput(fmt::format("a grid of {}x{} has more columns or rows than the wall's {}x{} pixels", columns,
                                    rows, wall.width, wall.height));
    if (columns * rows > kMaxTiles)
        return badInput(fmt::format("a grid of {}x{} has more than {} tiles", columns, rows, kMaxTiles));

    const auto edge = [](std::int64_t index, std::int64_t pixels, std::int64_t count) {
        return static_cast<std::int32_t>(index * pixels / count);
    };
    std::vector<TileAssignment> tiles;
    tiles.reserve(static_cast<std::size_t>(columns * rows));
    for (std::int64_t row = 0; row < rows; ++row) {
        const std::int32_t bottom = edge(row, wall.height, rows);
        const std::int32_t top = edge(row + 1, wall.height, rows);
        for (std::int64_t column = 0; column < columns; ++column) {
            const std::int32_t left = edge(column, wall.width, columns);
            const std::int32_t right = edge(column + 1, wall.width, columns);
            TileAssignment tile;
            tile.tile = static_cast<std::uint32_t>(tiles.size());
            tile.pixels = {left, bottom, right - left, top - bottom};
            tiles.push_back(tile);
        }
    }
    return tiles;
}

std::vector<std::vector<TileAssignment>> dealTiles(const std::vector<TileAssignment>& tiles, std::size_t servers) {
    std::vector<std::vector<TileAssignment>> dealt(servers);
    for (std::size_t i = 0; i < tiles.size(); ++i) dealt[i % servers].push_back(tiles[i]);
    return dealt;
}

}  // namespace umbriel
