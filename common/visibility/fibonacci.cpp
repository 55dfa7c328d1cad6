#include "common/visibility/fibonacci.h"

#include <cmath>
#include <numbers>

namespace umbriel::visibility::fibonacci {

glm::dvec3 direction(std::uint32_t count, std::uint32_t k) {
    const double square = (k + 0.5) / count;
    const double radius = std::sqrt(square);
    // Turns, reduced before the sine so that no digits are lost at large k.
    const double turns = k * (1.0 / std::numbers::phi) - std::floor(k * (1.0 / std::numbers::phi));
    const double azimuth = 2.0 * std::numbers::pi * turns;
    return {radius * std::cos(azimuth), radius * std::sin(azimuth), std::sqrt(1.0 - square)};
}

std::optional<std::uint32_t> pixelOf(std::uint32_t count, const glm::dvec3& d) {
    if (!(d.z > 0.0)) return std::nullopt;
    std::uint32_t best = 0;
    double largest = -2.0;
    for (std::uint32_t k = 0; k < count; ++k) {
        const double cosine = glm::dot(direction(count, k), d);
        if (cosine > largest) {
            largest = cosine;
            best = k;
        }
    }
    return best;
}

}  // namespace umbriel::visibility::fibonacci
