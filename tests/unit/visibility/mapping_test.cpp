#include "common/visibility/mapping.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <vector>

#include "common/visibility/hemi_cube.h"
#include "common/visibility/hemi_sphere.h"
#include "common/visibility/mesh.h"
#include "common/visibility/planar_pixels.h"
#include "common/visibility/single_plane.h"

namespace umbriel::visibility {
namespace {

using std::numbers::pi;
constexpr double kDegree = pi / 180.0;

const std::array kKinds{MappingKind::HemiCube, MappingKind::SinglePlane, MappingKind::HemiSphere,
                        MappingKind::Cube,     MappingKind::Octahedral,  MappingKind::Fibonacci};

Mapping make(MappingKind kind, std::uint32_t size, double fovyDegrees = 150.0) {
    return {kind, size, kind == MappingKind::SinglePlane ? fovyDegrees * kDegree : 0.0};
}

template <class Weight>
double sum(const Mapping& m, Weight weight) {
    // Kahan: the test is about the weights, not about adding a million of them.
    double total = 0.0, lost = 0.0;
    for (std::uint32_t p = 0; p < pixelCount(m); ++p) {
        const double value = weight(m, p) - lost;
        const double next = total + value;
        lost = (next - total) - value;
        total = next;
    }
    return total;
}

// The sizes that matter and, to 128, all even ones.
std::vector<std::uint32_t> sizes(std::uint32_t dense) {
    std::vector<std::uint32_t> result;
    for (std::uint32_t s = 2; s <= dense; s += 2) result.push_back(s);
    for (const std::uint32_t s : {200u, 256u, 512u}) result.push_back(s);
    return result;
}

TEST(Mapping, CosineWeightsAddUpToTheTotalAtEveryEvenSize) {
    for (const MappingKind kind : {MappingKind::HemiCube, MappingKind::HemiSphere, MappingKind::Cube}) {
        for (const std::uint32_t s : sizes(128)) {
            const Mapping m = make(kind, s);
            EXPECT_NEAR(sum(m, cosineWeight), totalCosineWeight(m), 1e-12) << name(kind) << " " << s;
        }
    }
    for (std::uint32_t s = 2; s <= 64; s += 2) {
        const Mapping m = make(MappingKind::Octahedral, s);
        EXPECT_NEAR(sum(m, cosineWeight), 2.0 * pi, 1e-12) << s;
    }
    for (const double fovy : {90.0, 120.0, 150.0, 165.0, 175.0, 178.0}) {
        for (const std::uint32_t s : {2u, 6u, 8u, 32u, 128u}) {
            const Mapping m = make(MappingKind::SinglePlane, s, fovy);
            EXPECT_NEAR(sum(m, cosineWeight), totalCosineWeight(m), 1e-12) << fovy << " " << s;
        }
    }
    EXPECT_NEAR(sum(make(MappingKind::Fibonacci, 1000), cosineWeight), pi, 1e-12);
}

TEST(Mapping, SolidAnglesAddUpToTheHalfOrWholeSphere) {
    for (const std::uint32_t s : sizes(64)) {
        EXPECT_NEAR(sum(make(MappingKind::HemiCube, s), solidAngle), 2.0 * pi, 1e-12) << s;
        EXPECT_NEAR(sum(make(MappingKind::HemiSphere, s), solidAngle), 2.0 * pi, 1e-12) << s;
        EXPECT_NEAR(sum(make(MappingKind::Cube, s), solidAngle), 4.0 * pi, 1e-12) << s;
        if (s <= 128) {
            EXPECT_NEAR(sum(make(MappingKind::Octahedral, s), solidAngle), 4.0 * pi, 1e-12) << s;
        }
    }
    // The pyramid of a plane: 4 asin(sin^2(fovy/2)).
    for (const double fovy : {90.0, 120.0, 170.0}) {
        const double sine = std::sin(0.5 * fovy * kDegree);
        EXPECT_NEAR(sum(make(MappingKind::SinglePlane, 8, fovy), solidAngle), 4.0 * std::asin(sine * sine), 1e-12);
    }
}

// The sum of products cannot tell elevations from polar angles (the thesis' two errors cancel there), rows of solid
// angles can: a horizon band up to elevation e holds 2 pi sin(e), a polar cap from it 2 pi (1 - sin(e)).
TEST(Mapping, HemiSphereRowsHaveTheSolidAngleOfTheirBands) {
    for (const std::uint32_t s : {8u, 32u, 64u}) {
        double band = 0.0;
        for (std::uint32_t row = 0; row < s / 2; ++row) {
            for (std::uint32_t i = 0; i < 2 * s; ++i) band += hemi_sphere::solidAngle(s, row * 2 * s + i);
            EXPECT_NEAR(band, 2.0 * pi * std::sin(pi * (row + 1) / s), 1e-12);
        }
    }
}

// The cosine alone, as weight / solid angle: the mean over a row is (sin e0 + sin e1) / 2.
TEST(Mapping, HemiSphereCosineIsTheSineOfTheElevation) {
    const std::uint32_t s = 16;
    for (std::uint32_t row = 0; row < s / 2; ++row) {
        const std::uint32_t p = row * 2 * s + 3;
        const double expected = 0.5 * (std::sin(pi * row / s) + std::sin(pi * (row + 1) / s));
        EXPECT_NEAR(hemi_sphere::cosineWeight(s, p) / hemi_sphere::solidAngle(s, p), expected, 1e-14);
        EXPECT_NEAR(hemi_sphere::direction(s, p).z, std::sin(pi * (row + 0.5) / s), 1e-15);
    }
}

// Lambert's formula over the outline is a second closed form, made from nothing but corners.
TEST(Mapping, CosineWeightIsTheVectorWeightAgainstTheNormal) {
    for (const MappingKind kind : {MappingKind::HemiCube, MappingKind::SinglePlane, MappingKind::HemiSphere,
                                   MappingKind::Cube, MappingKind::Octahedral}) {
        const Mapping m = make(kind, 10);
        for (std::uint32_t p = 0; p < pixelCount(m); ++p) {
            // On the octahedron's fold half of the pixel is below the horizon.
            if (std::abs(direction(m, p).z) < 1e-12) continue;
            EXPECT_NEAR(std::abs(vectorWeight(m, p).z), cosineWeight(m, p), 1e-14) << name(kind) << " " << p;
        }
    }
}

TEST(Mapping, HemiCubeTopAndSidesHaveTheirShare) {
    const std::uint32_t s = 12;
    double top = 0.0, sides = 0.0;
    for (std::uint32_t p = 0; p < hemi_cube::pixelCount(s); ++p)
        (p < s * s ? top : sides) += hemi_cube::cosineWeight(s, p);
    EXPECT_NEAR(top, 2.0 * std::numbers::sqrt2 * std::atan(1.0 / std::numbers::sqrt2), 1e-13);
    EXPECT_NEAR(sides, 4.0 * (pi / 4.0 - std::atan(1.0 / std::numbers::sqrt2) / std::numbers::sqrt2), 1e-13);
}

// Cosine and solid angle of single pixels against a fine midpoint rule over the pixel.
TEST(Mapping, EveryPixelIsItsOwnIntegral) {
    const std::uint32_t s = 4;
    const int n = 400;
    for (std::uint32_t p = 0; p < hemi_cube::pixelCount(s); ++p) {
        const auto corner = hemi_cube::corners(s, p);
        double cosine = 0.0, angle = 0.0;
        for (int j = 0; j < n; ++j) {
            for (int i = 0; i < n; ++i) {
                const glm::dvec3 x =
                    corner[0] + (corner[1] - corner[0]) * ((i + 0.5) / n) + (corner[3] - corner[0]) * ((j + 0.5) / n);
                const double r = glm::length(x);
                const double area = 4.0 / (s * s) / (static_cast<double>(n) * n);
                angle += area / (r * r * r);
                cosine += area * x.z / (r * r * r * r);
            }
        }
        EXPECT_NEAR(hemi_cube::solidAngle(s, p), angle, 1e-6);  // second order: (1/400)^2 of the value
        EXPECT_NEAR(hemi_cube::cosineWeight(s, p), cosine, 1e-6);
    }
}

TEST(Mapping, MidpointWeightsConvergeWithTheSquareOfTheSize) {
    // Thesis' way, sums at s = 8 and 16 against the exact total; measured 8.6e-3 and 2.1e-3 for the cube, 2.6e-2 and
    // 6.5e-3 for the sphere.
    const auto error = [](MappingKind kind, std::uint32_t s) {
        const Mapping m = make(kind, s);
        return std::abs(sum(m, midpointCosineWeight) / totalCosineWeight(m) - 1.0);
    };
    for (const MappingKind kind : {MappingKind::HemiCube, MappingKind::HemiSphere}) {
        EXPECT_NEAR(error(kind, 16) / error(kind, 32), 4.0, 0.1) << name(kind);
        EXPECT_NEAR(error(kind, 32) / error(kind, 64), 4.0, 0.05) << name(kind);
    }
    EXPECT_NEAR(error(MappingKind::HemiSphere, 8), 2.6e-2, 1e-3);
    EXPECT_NEAR(error(MappingKind::HemiCube, 8), 8.6e-3, 1e-3);
    // The printed table of HemiSphere is too large by 1/cos(pi/2s) in every row.
    const double printed = pi / 8 * std::sin(2 * pi * 0.5 / 8) * std::sin(pi / 16);
    EXPECT_NEAR(printed / hemi_sphere::cosineWeight(8, 0), 1.0 / std::cos(pi / 16), 1e-12);
}

// Ganster 2002, table 3: degrees between the normal and the first ray, to the two digits printed.
TEST(Mapping, SinglePlaneReproducesTableThree) {
    const std::array fovy{120, 130, 140, 150, 160, 170, 175};
    const std::map<std::uint32_t, std::array<double, 7>> table{
        {8, {17.02, 20.76, 25.91, 33.41, 45.07, 63.67, 76.13}}, {16, {8.70, 10.73, 13.65, 18.26, 26.62, 45.29, 63.71}},
        {32, {4.38, 5.41, 6.92, 9.37, 14.07, 26.80, 45.35}},    {64, {2.19, 2.71, 3.47, 4.71, 7.14, 14.17, 26.84}},
        {128, {1.10, 1.36, 1.74, 2.36, 3.59, 7.20, 14.20}},     {256, {0.55, 0.68, 0.87, 1.18, 1.79, 3.61, 7.21}}};
    for (const auto& [s, row] : table) {
        for (std::size_t i = 0; i < fovy.size(); ++i) {
            const double angle = single_plane::firstRayAngle(s, fovy[i] * kDegree);
            EXPECT_NEAR(angle / kDegree, row[i], 0.0051) << s << " " << fovy[i];
            const glm::dvec3 d = single_plane::direction(s, fovy[i] * kDegree, s / 2 * s + s / 2);
            EXPECT_NEAR(std::acos(d.z), angle, 1e-12);
        }
    }
    EXPECT_FALSE(single_plane::firstRayIsTooFar(32, 130 * kDegree));
    EXPECT_TRUE(single_plane::firstRayIsTooFar(32, 140 * kDegree));
    EXPECT_FALSE(single_plane::firstRayIsTooFar(64, 160 * kDegree));
}

TEST(Mapping, SinglePlaneTotalsOverTheOpeningAngle) {
    const std::map<int, double> shares{{90, .5541},  {100, .6376}, {110, .7158}, {120, .7870},
                                       {130, .8496}, {140, .9025}, {150, .9446}, {160, .9752},
                                       {165, .9860}, {170, .9938}, {175, .9984}, {178, .9998}};
    for (const auto& [fovy, share] : shares) {
        EXPECT_NEAR(single_plane::totalCosineWeight(fovy * kDegree) / pi, share, 6e-5) << fovy;
    }
}

TEST(Mapping, PixelOfTheCentreIsThePixel) {
    for (const MappingKind kind : kKinds) {
        for (const std::uint32_t s : {2u, 6u, 16u, 30u}) {
            const Mapping m = make(kind, s);
            for (std::uint32_t p = 0; p < pixelCount(m); ++p) {
                const auto found = pixelOf(m, direction(m, p) * 3.0);
                ASSERT_TRUE(found) << name(kind) << " " << s << " " << p;
                EXPECT_EQ(*found, p) << name(kind) << " " << s;
            }
        }
    }
}

RC_GTEST_PROP(Mapping, EveryDirectionHasAPixelOrIsOutside, ()) {
    const auto kind = *rc::gen::elementOf(kKinds);
    const Mapping m = make(kind, 2 * *rc::gen::inRange(1u, 20u));
    const auto coordinate = rc::gen::map(rc::gen::inRange(-1000, 1001), [](int i) { return i / 1000.0; });
    const glm::dvec3 d(*coordinate, *coordinate, *coordinate);
    RC_PRE(glm::length(d) > 0.0);
    const auto pixel = pixelOf(m, d);
    const bool wholeSphere = kind == MappingKind::Cube || kind == MappingKind::Octahedral;
    if (pixel) {
        RC_ASSERT(*pixel < pixelCount(m));
    } else {
        RC_ASSERT(!wholeSphere);
        RC_ASSERT(d.z <= 0.0 || kind == MappingKind::SinglePlane);
    }
}

TEST(Mapping, NeighboursShareTheirMiddle) {
    for (const MappingKind kind : kKinds) {
        const Mapping m = make(kind, 8);
        // Two pixels may touch in two places: along an edge and in the pole, or on both sides of a fold's end.
        std::set<std::array<double, 5>> seen;
        const std::vector<Neighbours> all = neighbours(m);
        for (const Neighbours& n : all) {
            const auto [low, high] = std::minmax(n.first, n.second);
            EXPECT_TRUE(seen.insert({double(low), double(high), n.middle.x, n.middle.y, n.middle.z}).second)
                << name(kind) << ": a pair twice";
            EXPECT_NEAR(glm::length(n.middle), 1.0, 1e-12);
            if (kind == MappingKind::HemiSphere && n.middle.z > 0.999) continue;  // the pole
            const glm::dvec3 a = direction(m, n.first), b = direction(m, n.second);
            EXPECT_LT(std::acos(std::min(1.0, glm::dot(n.middle, a))), 35 * kDegree) << name(kind);
            // A little off the middle lies one of the two.
            EXPECT_EQ(pixelOf(m, glm::mix(n.middle, a, 1e-6)), n.first)
                << name(kind) << " " << n.first << " " << n.second;
            EXPECT_EQ(pixelOf(m, glm::mix(n.middle, b, 1e-6)), n.second)
                << name(kind) << " " << n.first << " " << n.second;
        }
        std::size_t expected = 0;
        switch (kind) {
            case MappingKind::HemiCube:
                expected = (192 * 4 - 32) / 2;
                break;  // 32 at the horizon lack one
            case MappingKind::Cube:
                expected = (384 * 4 - 64) / 2;
                break;  // 64 there, on both sides
            case MappingKind::Octahedral:
                expected = 64 * 4 / 2;
                break;  // a closed sphere
            case MappingKind::SinglePlane:
                expected = 2 * 8 * 7;
                break;
            case MappingKind::HemiSphere:
                expected = 64 + 48 + 15;
                break;  // rings, columns, pole
            case MappingKind::Fibonacci:
                break;  // has no outlines
        }
        EXPECT_EQ(all.size(), expected) << name(kind);
    }
}

TEST(Mapping, PacketOrderIsAPermutationOfNeighbours) {
    for (const MappingKind kind : kKinds) {
        for (const std::uint32_t s : {2u, 6u, 32u}) {
            const Mapping m = make(kind, kind == MappingKind::Fibonacci ? s * s : s);
            std::vector<std::uint32_t> order = packetOrder(m);
            std::ranges::sort(order);
            ASSERT_EQ(order.size(), pixelCount(m));
            for (std::uint32_t p = 0; p < order.size(); ++p) ASSERT_EQ(order[p], p);
        }
        const Mapping m = make(kind, kind == MappingKind::Fibonacci ? 1024 : 32);
        const trace::DirectionPackets set = directionPackets(m);
        EXPECT_EQ(set.lanes() % trace::kPacket, 0u);
        EXPECT_EQ(set.lowerBegin, kind == MappingKind::Cube ? set.lanes() / 2 : set.lanes());
        double cosine = 0.0;
        for (std::size_t lane = 0; lane < set.lanes(); ++lane) {
            const std::size_t first = lane / trace::kPacket * trace::kPacket;
            cosine += set.x[lane] * set.x[first] + set.y[lane] * set.y[first] + set.z[lane] * set.z[first];
        }
        EXPECT_GT(cosine / static_cast<double>(set.lanes()), std::cos(20 * kDegree)) << name(kind);
    }
}

TEST(Mapping, SourceTableNamesThePixelThatLooksThere) {
    const Mapping cube = make(MappingKind::HemiCube, 64), sphere = make(MappingKind::HemiSphere, 32);
    const auto table = sourceTable(cube, sphere);
    for (std::uint32_t p = 0; p < table.size(); ++p) {
        ASSERT_NE(table[p], kNoSource);
        EXPECT_LT(std::acos(std::min(1.0, glm::dot(direction(cube, table[p]), direction(sphere, p)))), 1.5 / 64);
    }
    const auto cone = sourceTable(make(MappingKind::SinglePlane, 64, 90.0), sphere);
    EXPECT_EQ(cone.front(), kNoSource);
    EXPECT_NE(cone.back(), kNoSource);
}

TEST(Mapping, WrongParametersAreRefused) {
    EXPECT_FALSE(check({MappingKind::HemiSphere, 7, 0.0}));
    EXPECT_FALSE(check({MappingKind::HemiSphere, 0, 0.0}));
    EXPECT_FALSE(check({MappingKind::HemiCube, 2048, 0.0}));
    EXPECT_FALSE(check({MappingKind::Cube, 1024, 0.0}));
    EXPECT_FALSE(check({MappingKind::SinglePlane, 8, pi}));
    EXPECT_FALSE(check({MappingKind::SinglePlane, 8, std::nan("")}));
    EXPECT_FALSE(check({MappingKind::Octahedral, 8, 1.0}));
    EXPECT_FALSE(check({static_cast<MappingKind>(9), 8, 0.0}));
    EXPECT_FALSE(check({MappingKind::Fibonacci, 0, 0.0}));
    for (const MappingKind kind : kKinds) EXPECT_TRUE(check(make(kind, 16)));
    for (const MappingKind kind : kKinds) EXPECT_EQ(mappingKindNamed(name(kind)), kind);
    EXPECT_FALSE(mappingKindNamed("mirrorball"));
}

}  // namespace
}  // namespace umbriel::visibility
