#include "server/shadow/shadow_volume.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <map>
#include <random>

namespace umbriel {
namespace {

struct Mesh {
    std::vector<glm::vec3> positions;
    std::vector<std::uint32_t> indices;
};

// Each face with vertices of its own, as creased meshes are loaded.
Mesh cube() {
    Mesh mesh;
    for (int axis = 0; axis < 3; ++axis)
        for (const float side : {-1.0f, 1.0f}) {
            const auto base = static_cast<std::uint32_t>(mesh.positions.size());
            for (int i = 0; i < 4; ++i) {
                glm::vec3 p;
                p[axis] = side;
                p[(axis + 1) % 3] = i == 1 || i == 2 ? 1.0f : -1.0f;
                p[(axis + 2) % 3] = i >= 2 ? 1.0f : -1.0f;
                mesh.positions.push_back(p);
            }
            const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
                if (side < 0) std::swap(b, c);
                for (const std::uint32_t k : {a, b, c}) mesh.indices.push_back(base + k);
            };
            add(0, 1, 2);
            add(0, 2, 3);
        }
    return mesh;
}

Mesh soup(std::uint32_t seed, int triangles, int vertices) {
    std::mt19937 random(seed);
    const auto real = [&] { return static_cast<float>(random() % 2001) / 1000.0f - 1.0f; };
    Mesh mesh;
    for (int i = 0; i < vertices; ++i) {
        const float x = real(), y = real(), z = real();
        mesh.positions.emplace_back(x, y, z);
    }
    for (int i = 0; i < 3 * triangles; ++i) mesh.indices.push_back(random() % static_cast<unsigned>(vertices));
    return mesh;
}

std::vector<std::uint32_t> all(const ShadowVolume& volume) {
    std::vector<std::uint32_t> corners = volume.sides;
    corners.insert(corners.end(), volume.lightCap.begin(), volume.lightCap.end());
    corners.insert(corners.end(), volume.darkCap.begin(), volume.darkCap.end());
    return corners;
}

// Directed edges that no neighbour runs along the other way; all corners at infinity are one for a directional light.
int openEdges(const std::vector<std::uint32_t>& corners, bool directional) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        std::uint32_t a = corners[i];
        std::uint32_t b = corners[i - i % 3 + (i + 1) % 3];
        if (directional && (a & kExtruded)) a = kExtruded;
        if (directional && (b & kExtruded)) b = kExtruded;
        if (a < b) ++balance[{a, b}];
        if (b < a) --balance[{b, a}];
    }
    int open = 0;
    for (const auto& entry : balance) open += entry.second != 0;
    return open;
}

// Where a ray crosses a triangle: +1 from outside (against its winding's normal) inwards, -1 outwards, 0 not at all.
int crossing(const glm::dvec3& from, const glm::dvec3& direction, const glm::dvec3& a, const glm::dvec3& b,
             const glm::dvec3& c, double farthest) {
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double towards = glm::dot(direction, normal);
    if (towards == 0.0) return 0;
    const double t = glm::dot(a - from, normal) / towards;
    if (!(t > 0.0) || t > farthest) return 0;
    const glm::dvec3 p = from + t * direction;
    for (const auto& [u, v] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)})
        if (glm::dot(glm::cross(v - u, p - u), normal) < 0.0) return 0;
    return towards < 0.0 ? 1 : -1;
}

// How deep a point lies in the volume, its corners at infinity put far away.
int depthWithin(const Mesh& mesh, const ShadowVolume& volume, const glm::dvec4& light, const glm::dvec3& point) {
    const auto place = [&](std::uint32_t corner) {
        const glm::dvec3 p = mesh.positions[corner & ~kExtruded];
        if (!(corner & kExtruded)) return p;
        return p + 1e4 * glm::normalize(light.w * p - glm::dvec3(light));
    };
    const glm::dvec3 away = glm::normalize(glm::dvec3(0.31415, -0.52718, 0.79113));
    int depth = 0;
    const std::vector<std::uint32_t> corners = all(volume);
    for (std::size_t i = 0; i < corners.size(); i += 3)
        depth -= crossing(point, away, place(corners[i]), place(corners[i + 1]), place(corners[i + 2]), 1e9);
    return depth;
}

bool isBlocked(const Mesh& mesh, const glm::dvec4& light, const glm::dvec3& point) {
    const glm::dvec3 towards = glm::dvec3(light) - light.w * point;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const auto at = [&](std::size_t k) { return glm::dvec3(mesh.positions[mesh.indices[i + k]]); };
        if (crossing(point, towards, at(0), at(1), at(2), light.w == 0.0 ? 1e9 : 1.0) != 0) return true;
    }
    return false;
}

ShadowVolume volumeOf(const Mesh& mesh, const glm::dvec4& light, bool caps = true) {
    return shadowVolume(casterTopology(mesh.positions, mesh.indices), mesh.positions, light, caps);
}

TEST(ShadowVolume, ACubeSeenFromAboveCastsWithItsTopAlone) {
    const Mesh mesh = cube();
    const CasterTopology topology = casterTopology(mesh.positions, mesh.indices);
    EXPECT_TRUE(topology.isClosed);
    EXPECT_EQ(topology.edges.size(), 18u) << "12 edges and a diagonal on each side";
    const ShadowVolume sun = shadowVolume(topology, mesh.positions, {0, 0, 1, 0}, true);
    EXPECT_EQ(sun.lightCap.size(), 6u);
    EXPECT_EQ(sun.sides.size(), 4u * 3) << "a triangle to the point at infinity from each edge of the top";
    EXPECT_TRUE(sun.darkCap.empty());
    const ShadowVolume lamp = shadowVolume(topology, mesh.positions, {0, 0, 5, 1}, true);
    EXPECT_EQ(lamp.lightCap.size(), 6u);
    EXPECT_EQ(lamp.sides.size(), 4u * 6);
    EXPECT_EQ(lamp.darkCap.size(), 6u);
    const ShadowVolume bare = shadowVolume(topology, mesh.positions, {0, 0, 5, 1}, false);
    EXPECT_TRUE(bare.lightCap.empty() && bare.darkCap.empty());
    EXPECT_EQ(bare.sides, lamp.sides);
}

TEST(ShadowVolume, CountsWhereTheLightIsBlockedAndNowhereElse) {
    std::mt19937 random(7);
    const auto real = [&](double scale) { return scale * (static_cast<double>(random() % 200001) / 1e5 - 1.0); };
    int blocked = 0;
    for (int round = 0; round < 60; ++round) {
        const Mesh mesh = round % 2 == 0 ? cube() : soup(static_cast<std::uint32_t>(round), 12, 9);
        const bool directional = round % 4 < 2;
        glm::dvec4 light(real(1), real(1), 2.5 + real(1), directional ? 0.0 : 1.0);
        const ShadowVolume volume = volumeOf(mesh, light);
        for (int i = 0; i < 200; ++i) {
            const double x = real(4), y = real(4), z = -1.2 + real(3);
            const glm::dvec3 point(x, y, z);
            if (round % 2 == 0 && std::max({std::abs(x), std::abs(y), std::abs(z)}) < 1.0) continue;  // in the body
            const bool expected = isBlocked(mesh, light, point);
            EXPECT_EQ(depthWithin(mesh, volume, light, point) > 0, expected)
                << "round " << round << " at " << x << " " << y << " " << z;
            blocked += expected;
        }
    }
    EXPECT_GT(blocked, 500) << "or the points say nothing";
}

// Every triangle faces away from a light inside: all of them cast, and everything outside is dark.
TEST(ShadowVolume, ALightInsideABodyLeavesNoWayOut) {
    const Mesh mesh = cube();
    for (const glm::dvec4& light : {glm::dvec4(0, 0, 0, 1), glm::dvec4(0.9, -0.3, 0.4, 1)}) {
        const ShadowVolume volume = volumeOf(mesh, light);
        EXPECT_EQ(volume.lightCap.size(), 12u * 3);
        for (const glm::dvec3& point : {glm::dvec3(3, 1, 2), glm::dvec3(-5, 0.3, 0.1), glm::dvec3(0.2, 0.1, -7)})
            EXPECT_NE(depthWithin(mesh, volume, light, point), 0);
    }
}

TEST(ShadowVolume, OfAnOpenSheetCastsFromBothSides) {
    Mesh mesh;
    mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
    mesh.indices = {0, 1, 2};
    for (const double z : {3.0, -3.0}) {
        const ShadowVolume volume = volumeOf(mesh, {0, 0, z, 1});
        EXPECT_EQ(depthWithin(mesh, volume, {0, 0, z, 1}, {0.05, -0.1, -z}), 1);
        EXPECT_EQ(depthWithin(mesh, volume, {0, 0, z, 1}, {0.05, -0.1, z / 2}), 0);
    }
    EXPECT_TRUE(volumeOf(mesh, {3, 0, 0, 1}).sides.empty()) << "edge-on, nothing is cast";
}

TEST(ShadowVolume, ThreeTrianglesAtAnEdgeKeepTheCount) {
    Mesh mesh;
    mesh.positions = {{0, -1, 0}, {0, 1, 0}, {1, 0, 0.2f}, {-1, 0, 0.2f}, {0.2f, 0, 1}};
    mesh.indices = {0, 1, 2, 0, 1, 3, 0, 1, 4};
    const glm::dvec4 light(0.1, 0.2, 5, 1);
    const ShadowVolume volume = volumeOf(mesh, light);
    EXPECT_EQ(openEdges(all(volume), false), 0);
    EXPECT_EQ(depthWithin(mesh, volume, light, {0.5, 0, -1}), 1);
    EXPECT_EQ(depthWithin(mesh, volume, light, {-0.5, 0, -1}), 1);
}

TEST(ShadowVolume, NothingComesOfNothing) {
    EXPECT_TRUE(casterTopology({}, {}).edges.empty());
    const std::vector<glm::vec3> positions = {{0, 0, 0}, {1, 0, 0}, {0, 0, 0}};
    const CasterTopology line = casterTopology(positions, std::vector<std::uint32_t>{0, 1, 2, 0, 1, 9, 0, 1});
    EXPECT_TRUE(line.triangles.empty()) << "two equal corners; an index beyond the positions; half a triangle";
}

// Whatever the mesh, the volume has no hole that a view could count wrongly through.
RC_GTEST_PROP(ShadowVolume, IsClosed, (std::uint32_t seed)) {
    std::mt19937 random(seed);
    const Mesh mesh = soup(seed, 1 + static_cast<int>(random() % 40), 3 + static_cast<int>(random() % 12));
    const bool directional = random() % 2 == 0;
    const glm::dvec4 light(static_cast<double>(random() % 9) - 4, static_cast<double>(random() % 9) - 4,
                           static_cast<double>(random() % 9) - 4.5, directional ? 0.0 : 1.0);
    RC_ASSERT(openEdges(all(volumeOf(mesh, light)), directional) == 0);
    const auto ended = shadowVolume(casterTopology(mesh.positions, mesh.indices), mesh.positions, light, true, true);
    RC_ASSERT(openEdges(all(ended), false) == 0);
}

}  // namespace
}  // namespace umbriel
