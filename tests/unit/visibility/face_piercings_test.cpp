#include "common/visibility/face_piercings.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/visibility/test_meshes.h"

namespace umbriel::visibility {
namespace {

constexpr std::size_t kExamples = 5;

// Every triangle against every other.
FacePiercings plain(const Mesh& mesh, const MeshTopology& topo) {
    FacePiercings out;
    const auto count = static_cast<std::uint32_t>(topo.triangles.size());
    for (std::uint32_t s = 0; s < count; ++s) {
        for (std::uint32_t t = s + 1; t < count; ++t) {
            if (topo.degenerate[s] || topo.degenerate[t]) continue;
            if (!pierces(mesh.positions, topo, s, t) && !pierces(mesh.positions, topo, t, s)) continue;
            if (out.count++ < kExamples) out.examples.emplace_back(s, t);
        }
    }
    return out;
}

// A disc of `around` slivers about vertex 0; the rim's radius swings between 1 - swing and 1, its height by `waves`.
Mesh fan(std::uint32_t around, double swing, double height, int waves) {
    Mesh m;
    m.positions.emplace_back(0.0f);
    for (std::uint32_t i = 0; i < around; ++i) {
        const double a = 2.0 * std::numbers::pi * i / around;
        const double r = 1.0 - swing * (i * 7919 % around) / around;
        m.positions.emplace_back(r * std::cos(a), r * std::sin(a), height * std::sin(waves * a));
        m.indices.insert(m.indices.end(), {0, i + 1, (i + 1) % around + 1});
    }
    return m;
}

void append(Mesh& to, const Mesh& from) {
    const auto first = static_cast<std::uint32_t>(to.positions.size());
    to.positions.insert(to.positions.end(), from.positions.begin(), from.positions.end());
    for (const std::uint32_t i : from.indices) to.indices.push_back(i + first);
}

TEST(FacePiercings, FansWithoutCrossingsTakeAboutAsLongAsTheyAreLarge) {
    // All pairs of the boxes overlap. Pair by pair this took minutes: the watchdog is what fails.
    for (const double height : {0.0, 0.4}) {
        const Mesh m = fan(20000, 0.0, height, 1);
        EXPECT_EQ(facePiercings(m.positions, topology(m), kExamples).count, 0u) << height;
    }
}

TEST(FacePiercings, CrossingFansAreCountedAsPairByPair) {
    for (const std::uint32_t around : {300u, 700u}) {
        for (const double swing : {0.0, 0.6}) {
            Mesh m = fan(around, swing, 0.3, 5);
            append(m, test::moved(fan(around, swing, 0.2, 3), {0.21, 0.13, 0.02}));
            append(m, test::plate(4));
            const MeshTopology topo = topology(m);
            const FacePiercings expected = plain(m, topo), found = facePiercings(m.positions, topo, kExamples);
            EXPECT_GT(expected.count, 100u);
            EXPECT_EQ(found.count, expected.count) << around << " " << swing;
            EXPECT_EQ(found.examples, expected.examples);
        }
    }
}

// Coordinates are small whole numbers, so the tests are exact and much lies in one plane, on one line, on one point;
// the first vertices are in most triangles.
RC_GTEST_PROP(FacePiercings, AreThoseOfAllPairs, ()) {
    const int points = *rc::gen::inRange(4, 40);
    const int triangles = *rc::gen::inRange(1, 500);
    const int reach = *rc::gen::inRange(1, 12);
    Mesh m;
    for (int i = 0; i < points; ++i) {
        const auto coordinate = [&] { return static_cast<float>(*rc::gen::inRange(-reach, reach + 1)); };
        const float x = coordinate(), y = coordinate();
        m.positions.emplace_back(x, y, coordinate());
    }
    const auto corner = [&](int of) { return static_cast<std::uint32_t>(*rc::gen::inRange(0, of)); };
    for (int t = 0; t < triangles; ++t) {
        const std::uint32_t a = corner(3), b = corner(points);
        m.indices.insert(m.indices.end(), {a, b, corner(points)});
    }
    const MeshTopology topo = topology(m);
    const FacePiercings expected = plain(m, topo), found = facePiercings(m.positions, topo, kExamples);
    RC_ASSERT(found.count == expected.count);
    RC_ASSERT(found.examples == expected.examples);
}

}  // namespace
}  // namespace umbriel::visibility
