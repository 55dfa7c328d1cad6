#include "common/visibility/distance_map.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "common/visibility/map_maker.h"

namespace umbriel::visibility {
namespace {

using std::numbers::pi;

const std::vector<Mapping> kMappings{{MappingKind::HemiCube, 8},
                                     {MappingKind::SinglePlane, 12, 2.2},
                                     {MappingKind::HemiSphere, 16},
                                     {MappingKind::Cube, 6},
                                     {MappingKind::Octahedral, 14}};

bool hasHorizon(const Mapping& m) {
    return m.kind != MappingKind::Octahedral;
}

std::vector<std::uint8_t> randomMask(const Mapping& m, std::uint32_t seed, std::uint32_t blockedOfTen) {
    std::vector<std::uint8_t> mask(maskBytes(pixelCount(m)));
    for (std::uint32_t p = 0; p < pixelCount(m); ++p) {
        seed = seed * 1664525u + 1013904223u;
        if ((seed >> 16) % 10 >= blockedOfTen) mask[p / 8] |= static_cast<std::uint8_t>(1u << (p % 8));
    }
    return mask;
}

// Everything in double, over pairs of neighbours, without a list of boundary points.
double bruteForce(const Mapping& m, const std::vector<Neighbours>& pairs, const std::vector<std::uint8_t>& mask,
                  std::uint32_t pixel) {
    const glm::dvec3 d = direction(m, pixel);
    double angle = pi;
    for (const Neighbours& n : pairs) {
        if (isOpen(mask, n.first) == isOpen(mask, n.second)) continue;
        angle = std::min(angle, std::atan2(glm::length(glm::cross(d, n.middle)), glm::dot(d, n.middle)));
    }
    if (!isOpen(mask, pixel)) return -angle;
    return hasHorizon(m) ? std::min(angle, pi / 2 - std::acos(std::min(1.0, std::abs(d.z)))) : angle;
}

RC_GTEST_PROP(DistanceMap, IsBruteForceToRounding, (std::uint32_t seed)) {
    const Mapping m = *rc::gen::elementOf(kMappings);
    const auto mask = randomMask(m, seed, *rc::gen::inRange(0u, 11u));
    const DistanceMaps maps(m);
    DistanceMaps::Silhouette scratch;
    std::vector<float> distances(pixelCount(m));
    maps.compute(mask, scratch, distances);
    const auto pairs = neighbours(m);
    for (std::uint32_t p = 0; p < pixelCount(m); ++p) {
        // Single precision: chords of unit vectors rounded to 6e-8, worse towards the opposite point, where the arc
        // sine is steep.
        const double truth = bruteForce(m, pairs, mask, p);
        RC_ASSERT(std::abs(distances[p] - truth) < (std::abs(truth) > 3.0 ? 2e-3 : 4e-6));
    }
}

// A wall of the sky: everything on one side of a great circle through the normal is blocked. The distance is the angle
// to the circle, up to the half pixel by which the middles of the border miss it.
TEST(DistanceMap, HalfSkyHasTheAngleToItsEdge) {
    const Mapping m{MappingKind::HemiSphere, 64};
    std::vector<std::uint8_t> mask(maskBytes(pixelCount(m)));
    for (std::uint32_t p = 0; p < pixelCount(m); ++p) {
        if (direction(m, p).y > 0.0) mask[p / 8] |= static_cast<std::uint8_t>(1u << (p % 8));
    }
    const DistanceMaps maps(m);
    DistanceMaps::Silhouette scratch;
    std::vector<float> distances(pixelCount(m));
    maps.compute(mask, scratch, distances);
    for (std::uint32_t p = 0; p < pixelCount(m); ++p) {
        const glm::dvec3 d = direction(m, p);
        const double edge = std::asin(d.y);
        const double expected = d.y > 0.0 ? std::min(edge, std::asin(d.z)) : edge;
        EXPECT_NEAR(distances[p], expected, 0.5 * pi / 64) << p;
    }
}

TEST(DistanceMap, CrossesZeroInTheMiddleBetweenNeighbours) {
    const Mapping m{MappingKind::HemiCube, 16};
    const auto mask = randomMask(m, 5, 5);
    const DistanceMaps maps(m);
    DistanceMaps::Silhouette s;
    maps.silhouette(mask, s);
    for (const Neighbours& n : neighbours(m)) {
        if (isOpen(mask, n.first) == isOpen(mask, n.second)) continue;
        EXPECT_NEAR(maps.signedDistance(s, glm::vec3(n.middle), true), 0.0, 1e-6);
        EXPECT_NEAR(maps.signedDistance(s, glm::vec3(n.middle), false), 0.0, 1e-6);
    }
}

TEST(DistanceMap, OpenAndBlockedSkiesAreDefined) {
    for (const Mapping& m : kMappings) {
        const DistanceMaps maps(m);
        DistanceMaps::Silhouette scratch;
        std::vector<float> distances(pixelCount(m));
        maps.compute(randomMask(m, 1, 10), scratch, distances);
        for (const float d : distances) EXPECT_FLOAT_EQ(d, static_cast<float>(-pi));
        maps.compute(randomMask(m, 1, 0), scratch, distances);
        for (std::uint32_t p = 0; p < distances.size(); ++p) {
            const double expected = hasHorizon(m) ? std::asin(std::abs(direction(m, p).z)) : pi;
            EXPECT_NEAR(distances[p], expected, 1e-6) << name(m.kind);
        }
    }
}

// The sign says what the pixel is, so a ratio of distances of a lit and an unlit vertex is always in [0, 1].
RC_GTEST_PROP(DistanceMap, SignIsThePixel, (std::uint32_t seed)) {
    const Mapping m = *rc::gen::elementOf(kMappings);
    const auto mask = randomMask(m, seed, 5);
    const DistanceMaps maps(m);
    DistanceMaps::Silhouette scratch;
    std::vector<float> distances(pixelCount(m));
    maps.compute(mask, scratch, distances);
    for (std::uint32_t p = 0; p < pixelCount(m); ++p) RC_ASSERT((distances[p] > 0) == isOpen(mask, p));
}

}  // namespace
}  // namespace umbriel::visibility
