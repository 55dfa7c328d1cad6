#include "server/shadow/shadow_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

namespace umbriel {
namespace {

// Of each vertex: the first with its position. -0 equals 0.
std::vector<std::uint32_t> firstWithPosition(std::span<const glm::vec3> positions) {
    std::vector<std::uint32_t> order(positions.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto key = [&](std::uint32_t i) {
        const glm::vec3& p = positions[i];
        return std::tuple(p.x, p.y, p.z);
    };
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::tuple_cat(key(a), std::tuple(a)) < std::tuple_cat(key(b), std::tuple(b));
    });
    std::vector<std::uint32_t> first(positions.size());
    for (std::size_t i = 0; i < order.size(); ++i)
        first[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? first[order[i - 1]] : order[i];
    return first;
}

struct HalfEdge {
    std::uint32_t from, to, triangle;
    bool forward;
};

// 1: faces the light, -1: turned away, 0: edge-on or without area.
int facing(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec4& light) {
    const double side = glm::dot(glm::cross(b - a, c - a), glm::dvec3(light) - light.w * a);
    return side > 0.0 ? 1 : side < 0.0 ? -1 : 0;
}

// How often a closed mesh goes around a point: the sum of the solid angles of its triangles (van Oosterom & Strackee
// 1983) over 4 pi. 0 outside.
double turnsAround(const CasterTopology& topology, std::span<const glm::vec3> positions, const glm::dvec3& point) {
    glm::dvec3 lower(std::numeric_limits<double>::infinity()), upper = -lower;
    for (const glm::uvec3& t : topology.triangles)
        for (int k = 0; k < 3; ++k) {
            lower = glm::min(lower, glm::dvec3(positions[t[k]]));
            upper = glm::max(upper, glm::dvec3(positions[t[k]]));
        }
    if (glm::any(glm::lessThan(point, lower)) || glm::any(glm::greaterThan(point, upper))) return 0.0;
    double halves = 0.0;
    for (const glm::uvec3& t : topology.triangles) {
        const glm::dvec3 a = glm::dvec3(positions[t.x]) - point, b = glm::dvec3(positions[t.y]) - point,
                         c = glm::dvec3(positions[t.z]) - point;
        const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
        halves += std::atan2(glm::dot(a, glm::cross(b, c)),
                             la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
    }
    return halves / (2.0 * std::numbers::pi);
}

}  // namespace

CasterTopology casterTopology(std::span<const glm::vec3> positions, std::span<const std::uint32_t> indices) {
    const std::vector<std::uint32_t> first = firstWithPosition(positions);
    CasterTopology topology;
    std::vector<HalfEdge> halves;
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
        if (std::max({indices[i], indices[i + 1], indices[i + 2]}) >= positions.size()) continue;
        const glm::uvec3 corners(first[indices[i]], first[indices[i + 1]], first[indices[i + 2]]);
        if (corners.x == corners.y || corners.y == corners.z || corners.z == corners.x) continue;
        const auto triangle = static_cast<std::uint32_t>(topology.triangles.size());
        topology.triangles.push_back(corners);
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t from = corners[k];
            const std::uint32_t to = corners[(k + 1) % 3];
            halves.push_back({std::min(from, to), std::max(from, to), triangle, from < to});
        }
    }
    std::sort(halves.begin(), halves.end(), [](const HalfEdge& a, const HalfEdge& b) {
        return std::tie(a.from, a.to, a.triangle, a.forward) < std::tie(b.from, b.to, b.triangle, b.forward);
    });
    topology.isClosed = true;
    topology.uses.reserve(halves.size());
    for (std::size_t begin = 0; begin < halves.size();) {
        std::size_t end = begin;
        int balance = 0;
        for (; end < halves.size() && halves[end].from == halves[begin].from && halves[end].to == halves[begin].to;
             ++end) {
            topology.uses.push_back({halves[end].triangle, halves[end].forward});
            balance += halves[end].forward ? 1 : -1;
        }
        topology.edges.push_back(
            {halves[begin].from, halves[begin].to, static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end)});
        topology.isClosed = topology.isClosed && balance == 0;
        begin = end;
    }
    return topology;
}

ShadowVolume shadowVolume(const CasterTopology& topology, std::span<const glm::vec3> positions,
                          const glm::dvec4& lightObject, bool caps, bool finite) {
    const bool endsInPoint = lightObject.w == 0.0 && !finite;
    // What faces the light is all that casts of a body, unless the light is inside: then it is what faces away.
    const bool oneSided = topology.isClosed &&
                          (lightObject.w == 0.0 ||
                           std::abs(turnsAround(topology, positions, glm::dvec3(lightObject) / lightObject.w)) < 0.5);
    std::vector<std::int8_t> casts(topology.triangles.size());  // 1: as it is, -1: turned round, 0: not
    ShadowVolume volume;
    for (std::size_t i = 0; i < casts.size(); ++i) {
        const glm::uvec3& t = topology.triangles[i];
        const int side = facing(positions[t.x], positions[t.y], positions[t.z], lightObject);
        casts[i] = static_cast<std::int8_t>(oneSided ? std::max(side, 0) : side);
        if (!caps || casts[i] == 0) continue;
        const std::array<std::uint32_t, 3> lit = casts[i] > 0 ? std::array{t.x, t.y, t.z} : std::array{t.x, t.z, t.y};
        volume.lightCap.insert(volume.lightCap.end(), lit.begin(), lit.end());
        if (!endsInPoint)
            for (const int k : {0, 2, 1}) volume.darkCap.push_back(lit[static_cast<std::size_t>(k)] | kExtruded);
    }
    for (const CasterTopology::Edge& edge : topology.edges) {
        int balance = 0;
        for (std::uint32_t u = edge.begin; u < edge.end; ++u) {
            const CasterTopology::Use& use = topology.uses[u];
            balance += use.forward ? casts[use.triangle] : -casts[use.triangle];
        }
        // The cap runs along the edge one way, its sides the other.
        std::uint32_t a = edge.to;
        std::uint32_t b = edge.from;
        if (balance < 0) std::swap(a, b);
        for (int copy = 0; copy < std::abs(balance); ++copy) {
            volume.sides.insert(volume.sides.end(), {a, b, b | kExtruded});
            if (!endsInPoint) volume.sides.insert(volume.sides.end(), {a, b | kExtruded, a | kExtruded});
        }
    }
    return volume;
}

}  // namespace umbriel
