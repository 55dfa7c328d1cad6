#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/math/glm.h"

namespace umbriel::trace {

inline constexpr std::size_t kPacket = 8;
inline constexpr std::uint32_t kNoPixel = ~0u;

// A set of ray directions in packets of eight neighbours, in the frame of the set. Lanes before `lowerBegin` are seen
// from the normal's side of the surface, the rest from the other side; both parts are whole packets, filled up with
// lanes whose pixel is kNoPixel.
struct DirectionPackets {
    std::vector<float> x, y, z;
    std::vector<std::uint32_t> pixel;
    std::size_t lowerBegin = 0;
    std::size_t lanes() const { return pixel.size(); }
    std::size_t packets() const { return pixel.size() / kPacket; }
};

// A point of the surface from which rays leave.
struct Origin {
    std::uint32_t position = 0;  // index into Triangles::positions
    glm::vec3 normal{0, 0, 1};   // unit
    // World from set: the columns are the axes of the set's frame. The direction of a ray is, in single precision,
    // (column 0 * x + column 1 * y) + column 2 * z.
    glm::mat3 axes{1.0f};
};

// That direction: every maker and every reference uses this one, so that they argue about the same ray.
inline glm::vec3 worldDirection(const Origin& origin, float x, float y, float z) {
    const glm::mat3& a = origin.axes;
    return {(a[0].x * x + a[1].x * y) + a[2].x * z, (a[0].y * x + a[1].y * y) + a[2].y * z,
            (a[0].z * x + a[1].z * y) + a[2].z * z};
}

}  // namespace umbriel::trace
