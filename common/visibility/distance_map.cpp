#include "common/visibility/distance_map.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "common/base/assert.h"
#include "common/visibility/map_maker.h"

namespace umbriel::visibility {
namespace {

// Above any square of a chord of the unit sphere.
constexpr float kNone = 5.0f;

// Square of the smallest chord to a boundary point, in eight independent strands: the order is fixed, so every
// instruction set finds the same. As a chord and not as a dot product, which has no digits left at small angles.
[[gnu::always_inline]] inline float nearestSquareBody(const DistanceMaps::Silhouette& s, const glm::vec3& d) {
    // The compiler's vectors: eight lanes on AVX2, pairs of four elsewhere, with the same result.
    typedef float Lanes __attribute__((vector_size(32)));
    constexpr std::size_t kStrands = 8;
    const float* px = s.x.data();
    const float* py = s.y.data();
    const float* pz = s.z.data();
    Lanes best = Lanes{} + kNone;
    const std::size_t whole = s.size() / kStrands * kStrands;
    for (std::size_t i = 0; i < whole; i += kStrands) {
        Lanes x, y, z;
        std::memcpy(&x, px + i, sizeof x);
        std::memcpy(&y, py + i, sizeof y);
        std::memcpy(&z, pz + i, sizeof z);
        x -= d.x;
        y -= d.y;
        z -= d.z;
        const Lanes value = (x * x + y * y) + z * z;
        best = value < best ? value : best;
    }
    float result = kNone;
    for (std::size_t k = 0; k < kStrands; ++k) result = std::min(result, best[k]);
    for (std::size_t i = whole; i < s.size(); ++i) {
        const float x = px[i] - d.x, y = py[i] - d.y, z = pz[i] - d.z;
        result = std::min(result, (x * x + y * y) + z * z);
    }
    return result;
}

float nearestSquarePlain(const DistanceMaps::Silhouette& s, const glm::vec3& d) {
    return nearestSquareBody(s, d);
}

#if defined(__x86_64__) && defined(__GNUC__)
[[gnu::target("avx2")]] float nearestSquareAvx2(const DistanceMaps::Silhouette& s, const glm::vec3& d) {
    return nearestSquareBody(s, d);
}
#endif

float nearestSquare(const DistanceMaps::Silhouette& s, const glm::vec3& d) {
#if defined(__x86_64__) && defined(__GNUC__)
    if (__builtin_cpu_supports("avx2")) return nearestSquareAvx2(s, d);
#endif
    return nearestSquarePlain(s, d);
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
