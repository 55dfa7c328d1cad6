#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/trace/direction_packets.h"

namespace umbriel::trace {

// What a point's own triangles block. Seen from P + delta n, delta -> 0+, each of them is an infinite wedge with its
// apex at P: scale free, so nothing is lifted out of folds and nothing hits itself. A direction d is blocked by the
// wedge along the edges e0, e1 exactly when d . q < 0, d . m0 >= 0 and d . m1 <= 0, with q = e0 x e1 turned so that q .
// n > 0, and m = n x e. Edges shared by two wedges have one m, so no direction slips between them. Evaluated in single
// precision, eight directions at a time; what lies within the rounding of a border is decided in double from the ray's
// own (single precision) direction. One for each thread: it keeps scratch memory.
class Fan {
 public:
    // The point lies at the origin of `edges`: two for each own triangle, exact differences of positions.
    void reset(const Origin& origin, std::span<const glm::dvec3> edges);

    // Bit i of blocked[k]: lane 8 k + i is blocked. One byte for each packet.
    void blocked(const DirectionPackets& directions, std::span<std::uint8_t> blocked);
    // One direction, in double. The limit is from the normal's side or, with lower, from the other.
    bool blocks(const glm::dvec3& worldDirection, bool lower) const;

 private:
    struct Wedge {
        glm::dvec3 q, m0, m1;  // world; not normalised, which would round what the positions hold exactly
    };
    struct Wedge32 {
        float q[3], m0[3], m1[3];  // unit length, in the frame of the set
    };
    Origin _origin;
    std::vector<Wedge> _wedges;
    std::vector<Wedge32> _wedges32;
    std::vector<std::uint8_t> _unsure;  // scratch of classify()

    void classify(const DirectionPackets& directions, std::size_t begin, std::size_t end, bool lower,
                  std::span<std::uint8_t> blocked);
};

}  // namespace umbriel::trace
