#include "common/visibility/index_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/assert.h"
#include "common/visibility/map_maker.h"

namespace umbriel::visibility {

bool indexable(const EnvironmentSize& size) {
    return size.width > 0 && size.height > 0 && size.width <= kBlockedIndex && size.height <= kBlockedIndex &&
           static_cast<std::uint64_t>(size.width) * size.height <= kBlockedIndex;
}

std::uint16_t environmentIndex(const EnvironmentSize& size, const glm::vec3& d) {
    using std::numbers::pi;
    const glm::dvec3 direction(d);
    const double down = std::atan2(std::hypot(direction.x, direction.z), direction.y);
    const double around = std::atan2(direction.x, -direction.z) + pi;
    const auto x = std::min(static_cast<std::uint32_t>(around / (2.0 * pi) * size.width), size.width - 1);
    const auto y = std::min(static_cast<std::uint32_t>(down / pi * size.height), size.height - 1);
    return static_cast<std::uint16_t>(y * size.width + x);
}

void indexMap(const trace::DirectionPackets& set, const trace::Origin& origin, std::span<const std::uint8_t> mask,
              const EnvironmentSize& size, std::span<std::uint16_t> indices) {
    UMBRIEL_ASSERT(indexable(size), "an environment of up to 65535 texels");
    std::ranges::fill(indices, kBlockedIndex);
    for (std::size_t lane = 0; lane < set.lanes(); ++lane) {
        const std::uint32_t pixel = set.pixel[lane];
        if (pixel == trace::kNoPixel || !isOpen(mask, pixel)) continue;
        indices[pixel] = environmentIndex(size, worldDirection(origin, set.x[lane], set.y[lane], set.z[lane]));
    }
}

}  // namespace umbriel::visibility
