#include "common/visibility/distance_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/assert.h"
#include "common/visibility/map_maker.h"

namespace umbriel::visibility {
namespace {

// Above any square of a chord of the unit sphere.
constexpr float kNone = 5.0f;

// Square of the smallest chord to a boundary point, in eight independent strands: the order is fixed, so every
// instruction set finds the same. As a chord and not as a dot product, which has no digits left at small angles.
float nearestSquare(const DistanceMaps::Silhouette& s, const glm::vec3& d) {
    constexpr std::size_t kStrands = 8;
    float best[kStrands];
    std::fill_n(best, kStrands, kNone);
    const auto square = [&](std::size_t i) {
        const float x = s.x[i] - d.x, y = s.y[i] - d.y, z = s.z[i] - d.z;
        return (x * x + y * y) + z * z;
    };
    const std::size_t whole = s.size() / kStrands * kStrands;
    for (std::size_t i = 0; i < whole; i += kStrands) {
        for (std::size_t k = 0; k < kStrands; ++k) {
            const float value = square(i + k);
            best[k] = value < best[k] ? value : best[k];
        }
    }
    float result = *std::min_element(best, best + kStrands);
    for (std::size_t i = whole; i < s.size(); ++i) result = std::min(result, square(i));
    return result;
}

}  // namespace

void DistanceMaps::Silhouette::clear() {
    x.clear();
    y.clear();
    z.clear();
}

DistanceMaps::DistanceMaps(const Mapping& mapping)
    : _mapping(mapping),
      _neighbours(neighbours(mapping)),
      _horizon(mapping.kind == MappingKind::HemiCube || mapping.kind == MappingKind::SinglePlane ||
               mapping.kind == MappingKind::HemiSphere || mapping.kind == MappingKind::Cube) {
    UMBRIEL_ASSERT(mapping.kind != MappingKind::Fibonacci, "no distance map without neighbours");
    for (const Neighbours& n : _neighbours) _middles.emplace_back(n.middle);
    for (std::uint32_t p = 0; p < pixelCount(mapping); ++p) _directions.emplace_back(direction(mapping, p));
}

void DistanceMaps::silhouette(std::span<const std::uint8_t> mask, Silhouette& out) const {
    out.clear();
    for (std::size_t i = 0; i < _neighbours.size(); ++i) {
        if (isOpen(mask, _neighbours[i].first) == isOpen(mask, _neighbours[i].second)) continue;
        // The pole of HemiSphere is named by many pairs, one after another; once is enough.
        const glm::vec3& m = _middles[i];
        if (out.size() > 0 && m == glm::vec3(out.x.back(), out.y.back(), out.z.back())) continue;
        out.x.push_back(m.x);
        out.y.push_back(m.y);
        out.z.push_back(m.z);
    }
}

float DistanceMaps::signedDistance(const Silhouette& s, const glm::vec3& d, bool open) const {
    const float pi = std::numbers::pi_v<float>;
    const float square = nearestSquare(s, d);
    float angle = square >= kNone ? pi : 2.0f * std::asin(std::min(1.0f, 0.5f * std::sqrt(square)));
    if (!open) return -angle;
    if (_horizon) angle = std::min(angle, std::asin(std::min(1.0f, std::abs(d.z))));
    return angle;
}

void DistanceMaps::compute(std::span<const std::uint8_t> mask, Silhouette& scratch, std::span<float> distances) const {
    UMBRIEL_ASSERT(distances.size() == _directions.size(), "one distance for each pixel");
    silhouette(mask, scratch);
    for (std::uint32_t p = 0; p < _directions.size(); ++p) {
        distances[p] = signedDistance(scratch, _directions[p], isOpen(mask, p));
    }
}

}  // namespace umbriel::visibility
