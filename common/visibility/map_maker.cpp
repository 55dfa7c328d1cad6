#include "common/visibility/map_maker.h"

#include <algorithm>

#include "common/base/assert.h"

namespace umbriel::visibility {

MaskPacker::MaskPacker(const trace::DirectionPackets& directions) : _pixel(directions.pixel) {
    for (std::size_t lane = 0; lane < _pixel.size(); lane += trace::kPacket) {
        const std::uint32_t* p = &_pixel[lane];
        const auto four = [&](std::size_t at) {
            return p[at] % 4 == 0 && p[at + 1] == p[at] + 1 && p[at + 2] == p[at] + 2 && p[at + 3] == p[at] + 3;
        };
        Tile tile{p[0] / 8, p[4] / 8, static_cast<std::uint8_t>(p[0] % 8), static_cast<std::uint8_t>(p[4] % 8), false};
        tile.simple = four(0) && four(4);
        _tiles.push_back(tile);
    }
}

void MaskPacker::pack(std::span<const std::uint8_t> blocked, std::span<std::uint8_t> mask) const {
    UMBRIEL_ASSERT(blocked.size() == _tiles.size(), "one byte for each packet");
    std::ranges::fill(mask, std::uint8_t{0});
    for (std::size_t packet = 0; packet < _tiles.size(); ++packet) {
        const unsigned open = static_cast<std::uint8_t>(~blocked[packet]);
        const Tile& tile = _tiles[packet];
        if (tile.simple) {
            mask[tile.lowByte] |= static_cast<std::uint8_t>((open & 15u) << tile.lowShift);
            mask[tile.highByte] |= static_cast<std::uint8_t>((open >> 4) << tile.highShift);
            continue;
        }
        for (std::size_t i = 0; i < trace::kPacket; ++i) {
            const std::uint32_t pixel = _pixel[packet * trace::kPacket + i];
            if (pixel != trace::kNoPixel && (open >> i & 1) != 0) {
                mask[pixel / 8] |= static_cast<std::uint8_t>(1u << (pixel % 8));
            }
        }
    }
}

}  // namespace umbriel::visibility
