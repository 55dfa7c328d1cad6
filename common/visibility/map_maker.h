#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/trace/direction_packets.h"
#include "common/visibility/mapping.h"

namespace umbriel::visibility {

// A map: one bit for each pixel, 1 = open (background, nothing in the way), pixel p is bit p % 8 of byte p / 8, bits
// after the last pixel are 0.
inline std::size_t maskBytes(std::uint32_t pixels) {
    return (pixels + 7) / 8;
}
inline bool isOpen(std::span<const std::uint8_t> mask, std::uint32_t pixel) {
    return (mask[pixel / 8] >> (pixel % 8) & 1) != 0;
}

// From what a maker found for packets of rays to the pixels of a map.
class MaskPacker {
 public:
    explicit MaskPacker(const trace::DirectionPackets& directions);
    // blocked: one byte for each packet. mask: maskBytes().
    void pack(std::span<const std::uint8_t> blocked, std::span<std::uint8_t> mask) const;

 private:
    std::vector<std::uint32_t> _pixel;
    // Where a packet is four pixels of one row beside each other above four of the next, both at multiples of four.
    struct Tile {
        std::uint32_t lowByte, highByte;
        std::uint8_t lowShift, highShift;
        bool simple;
    };
    std::vector<Tile> _tiles;
};

}  // namespace umbriel::visibility
