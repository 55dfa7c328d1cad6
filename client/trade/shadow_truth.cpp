#include "client/trade/shadow_truth.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <thread>

#include "client/trade/map_texels.h"
#include "common/math/disc_sampling.h"

namespace umbriel {
namespace {

using trace::OcclusionScene;
using Ray = OcclusionScene::Ray;

// Rows are given out one by one; what happens in a row depends on nothing else.
template <class Row>
void forEachRow(int rows, int threads, const Row& row) {
    const int count =
        std::min(rows, threads > 0 ? threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
    std::atomic<int> next = 0;
    const auto work = [&] {
        for (int y = next++; y < rows; y = next++) row(y);
    };
    std::vector<std::thread> others;
    for (int i = 1; i < count; ++i) others.emplace_back(work);
    work();
    for (std::thread& other : others) other.join();
}

// To the light's middle; for a directional light a unit vector without an end.
Ray toMiddle(const TruthLight& light, const glm::dvec3& point) {
    if (light.kind == LightKind::Directional) return {-light.directionWorld};
    return {light.positionWorld - point, 1.0};
}

Ray toSample(const TruthLight& light, const Ray& middle, const AxesAcross& axes, const glm::dvec2& disc) {
    const glm::dvec2 at = disc * (light.kind == LightKind::Directional ? std::tan(light.radius) : light.radius);
    return {middle.direction + axes.u * at.x + axes.v * at.y, middle.farDistance};
}

struct Strata {
    std::vector<glm::ivec2> places;
    std::size_t first = 0;  // how many of them come first
};
// First the rim, which any edge that enters the disc crosses, and a ninth of what is within it.
Strata strataOf(int side) {
    Strata strata;
    for (const bool first : {true, false}) {
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) {
                const bool rim = std::min(x, y) == 0 || std::max(x, y) == side - 1;
                if ((rim || (x % 3 == 1 && y % 3 == 1)) == first) strata.places.emplace_back(x, y);
            }
        if (first) strata.first = strata.places.size();
    }
    return strata;
}

glm::dvec3 originOf(const ShadowScene& scene, const SurfacePoints& points, std::size_t i, std::uint32_t triangle) {
    const glm::dvec3 world = points.world(i);
    return triangle == OcclusionScene::kNoTriangle ? world : scene.rays().onPlaneOf(triangle, world);
}

}  // namespace

std::vector<float> shadowTruth(const ShadowScene& scene, const SurfacePoints& points, std::size_t lightIndex,
                               const TruthOptions& options) {
    std::vector<float> factors(points.size(), 1.0f);
    const TruthLight& light = scene.lights()[lightIndex];
    if (!light.castsShadow) return factors;
    const int side = std::clamp(options.lightSamplesPerSide, 1, 256);
    const auto [strata, firstRound] = strataOf(side);
    forEachRow(points.height, options.threads, [&, &strata = strata, firstRound = firstRound](int y) {
        std::vector<Ray> rays(strata.size());
        std::vector<std::uint8_t> hits(strata.size());
        for (int x = 0; x < points.width; ++x) {
            const std::size_t i =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(points.width) + static_cast<std::size_t>(x);
            if (!points.covered(i)) continue;
            const std::uint32_t own = scene.triangleOf(points.nodes[i], points.primitives[i]);
            const glm::dvec3 origin = originOf(scene, points, i, own);
            const Ray middle = toMiddle(light, origin);
            if (!(light.radius > 0.0)) {
                factors[i] = scene.rays().blocked(origin, own, middle) ? 0.0f : 1.0f;
                continue;
            }
            if (!(glm::length(middle.direction) > 0.0)) continue;
            const AxesAcross axes = axesAcross(middle.direction);
            for (std::size_t k = 0; k < strata.size(); ++k) {
                const double u = (strata[k].x + hashedUnit(i, 2 * k)) / side,
                             v = (strata[k].y + hashedUnit(i, 2 * k + 1)) / side;
                rays[k] = toSample(light, middle, axes, discFromSquare(u, v));
            }
            const auto count = [&](std::size_t first, std::size_t end) {
                scene.rays().blocked(origin, own, std::span(rays).subspan(first, end - first),
                                     std::span(hits).subspan(first, end - first));
                return static_cast<std::size_t>(std::count(hits.begin() + static_cast<std::ptrdiff_t>(first),
                                                           hits.begin() + static_cast<std::ptrdiff_t>(end), 1));
            };
            std::size_t blocked = count(0, firstRound), traced = firstRound;
            if (blocked != 0 && blocked != firstRound) {
                blocked += count(firstRound, strata.size());
                traced = strata.size();
            }
            factors[i] = 1.0f - static_cast<float>(blocked) / static_cast<float>(traced);
        }
    });
    return factors;
}

std::vector<std::uint8_t> judgedPixels(const ShadowScene& scene, const SurfacePoints& points, std::size_t lightIndex,
                                       const std::vector<std::uint8_t>& silhouette, const JudgedOptions& options) {
    const TruthLight& light = scene.lights()[lightIndex];
    std::vector<std::uint8_t> judged(points.size(), 0);
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!points.covered(i) || silhouette[i] || (options.only && !(*options.only)[i])) continue;
        if (!scene.reaches(lightIndex, points.nodes[i])) continue;
        if (scene.triangleOf(points.nodes[i], points.primitives[i]) == OcclusionScene::kNoTriangle) continue;
        const glm::dvec3 toLight = toMiddle(light, points.world(i)).direction;
        const double distance = glm::length(toLight);
        if (!(distance > 0.0)) continue;
        double cosine = glm::dot(glm::dvec3(points.normals[i]), toLight) / distance;
        if (options.bothSides) cosine = std::abs(cosine);
        if (!(cosine >= options.smallestCosine)) continue;
        if (light.kind != LightKind::Directional && light.range > 0.0 && distance >= light.range) continue;
        if (light.kind == LightKind::Spot && glm::dot(-toLight, light.directionWorld) <= light.cosOuter * distance)
            continue;
        judged[i] = 1;
    }
    return judged;
}

std::vector<std::uint8_t> pixelsOf(const SurfacePoints& points, const std::vector<std::uint32_t>& nodes) {
    std::vector<std::uint8_t> mask(points.size(), 0);
    for (std::size_t i = 0; i < points.size(); ++i)
        mask[i] = points.covered(i) && std::binary_search(nodes.begin(), nodes.end(), points.nodes[i]) ? 1 : 0;
    return mask;
}

BeyondTexel beyondTexel(const ShadowScene& scene, const SurfacePoints& points, std::size_t lightIndex,
                        std::span<const ShadowFit> fits, const std::vector<float>& truth,
                        const std::vector<float>& result, const std::vector<std::uint8_t>& judged, double texels,
                        int threads) {
    constexpr int kDirections = 16;
    const int rings = std::max(2, static_cast<int>(std::ceil(2.0 * texels)));  // half a texel apart
    const TruthLight& light = scene.lights()[lightIndex];
    std::atomic<std::uint64_t> leaks = 0, acne = 0;
    forEachRow(points.height, threads, [&](int y) {
        for (int x = 0; x < points.width; ++x) {
            const std::size_t i =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(points.width) + static_cast<std::size_t>(x);
            if (!judged[i] || (truth[i] < 0.5f) == (result[i] < 0.5f)) continue;
            const std::uint32_t own = scene.triangleOf(points.nodes[i], points.primitives[i]);
            const glm::dvec3 origin = originOf(scene, points, i, own);
            const AxesAcross plane = axesAcross(glm::dvec3(points.normals[i]));
            const auto texel = surfaceFromTexels(fits, points.eyeWorld, origin - points.eyeWorld, plane);
            const bool truthDark = truth[i] < 0.5f;
            bool edge = false;  // and none is excused where there is no map at all
            for (int k = 0; texel && k < rings * kDirections && !edge; ++k) {
                const double angle = 2.0 * std::numbers::pi * k / kDirections;
                const double reach = texels * (1 + k / kDirections) / rings;
                const glm::dvec2 moved = *texel * (reach * glm::dvec2(std::cos(angle), std::sin(angle)));
                const glm::dvec3 from = origin + plane.u * moved.x + plane.v * moved.y;
                edge = scene.rays().blocked(from, own, toMiddle(light, from)) != truthDark;
            }
            if (!edge) ++(truthDark ? leaks : acne);
        }
    });
    return {leaks, acne};
}

}  // namespace umbriel
