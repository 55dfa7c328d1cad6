#include "common/trace/triangles.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace umbriel::trace {

NormalisedPositions normalise(std::span<const glm::vec3> positions) {
    NormalisedPositions result;
    if (positions.empty()) return result;
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
    for (const glm::vec3& p : positions) {
        low = glm::min(low, glm::dvec3(p));
        high = glm::max(high, glm::dvec3(p));
    }
    for (int axis = 0; axis < 3; ++axis) {
        const float middle = static_cast<float>(0.5 * (low[axis] + high[axis]));
        const bool exact = std::ranges::all_of(positions, [&](const glm::vec3& p) {
            const double moved = static_cast<double>(p[axis]) - middle;
            return static_cast<double>(static_cast<float>(moved)) == moved;
        });
        if (exact) result.centre[axis] = middle;
    }
    const double diagonal = glm::length(high - low);
    int exponent = 0;
    if (diagonal > 0.0) std::frexp(diagonal, &exponent);
    result.scale = std::ldexp(1.0, 1 - exponent);
    result.diagonal = diagonal * result.scale;
    result.positions.reserve(positions.size());
    for (const glm::vec3& p : positions) {
        result.positions.emplace_back((glm::dvec3(p) - result.centre) * result.scale);
    }
    return result;
}

}  // namespace umbriel::trace
