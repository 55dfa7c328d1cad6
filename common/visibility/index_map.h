#pragma once

#include <cstdint>
#include <span>

#include "common/math/glm.h"
#include "common/trace/direction_packets.h"
#include "common/visibility/mapping.h"

namespace umbriel::visibility {

// Which texel of an environment an open pixel sees: y * width + x in a latitude-longitude picture whose first row is
// the sky straight up (+y) and whose middle column is -z. Mappings in the object frame need none of this.
struct EnvironmentSize {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    friend bool operator==(const EnvironmentSize&, const EnvironmentSize&) = default;
};

inline constexpr std::uint16_t kBlockedIndex = 0xffff;

// Whether indices fit into 16 bits beside kBlockedIndex.
bool indexable(const EnvironmentSize& size);
std::uint16_t environmentIndex(const EnvironmentSize& size, const glm::vec3& worldDirection);
// One index for each pixel, kBlockedIndex where the mask (map_maker.h) is blocked. The origin gives the vertex's axes.
void indexMap(const trace::DirectionPackets& directions, const trace::Origin& origin,
              std::span<const std::uint8_t> mask, const EnvironmentSize& size, std::span<std::uint16_t> indices);

}  // namespace umbriel::visibility
