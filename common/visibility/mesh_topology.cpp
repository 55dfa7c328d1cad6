#include "common/visibility/mesh_topology.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>

namespace umbriel::visibility {

Result<void> checkIndices(const Mesh& mesh) {
    if (mesh.indices.empty()) return badInput("the mesh has no triangles");
    if (mesh.indices.size() % 3 != 0) {
        return badInput(fmt::format("the mesh has {} indices, not three for each triangle", mesh.indices.size()));
    }
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
        if (mesh.indices[i] >= mesh.positions.size()) {
            return badInput(fmt::format("triangle {} names vertex {}, but the mesh has {}", i / 3, mesh.indices[i],
                                        mesh.positions.size()));
        }
    }
    return {};
}

std::vector<std::uint32_t> nonFinite(const Mesh& mesh) {
    std::vector<std::uint32_t> result;
    for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
        const glm::vec3& p = mesh.positions[v];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) result.push_back(v);
    }
    return result;
}

MeshTopology topology(const Mesh& mesh) {
    MeshTopology out;
    const auto key = [&](std::uint32_t v) {
        const glm::vec3& p = mesh.positions[v];
        return std::array{p.x, p.y, p.z};
    };
    std::vector<std::uint32_t> order(mesh.positions.size());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::sort(order,
                      [&](std::uint32_t a, std::uint32_t b) { return key(a) != key(b) ? key(a) < key(b) : a < b; });
    out.positionOf.resize(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        const bool same = i > 0 && key(order[i]) == key(order[i - 1]);
        out.positionOf[order[i]] = same ? out.positionOf[order[i - 1]] : order[i];
    }

    struct HalfEdge {
        std::uint32_t from, to, triangle;
        bool forward;
    };
    std::vector<HalfEdge> halves;
    for (std::uint32_t t = 0; t < mesh.indices.size() / 3; ++t) {
        const glm::uvec3 c(out.positionOf[mesh.indices[3 * t]], out.positionOf[mesh.indices[3 * t + 1]],
                           out.positionOf[mesh.indices[3 * t + 2]]);
        const glm::dvec3 a(mesh.positions[c.x]), b(mesh.positions[c.y]), d(mesh.positions[c.z]);
        out.triangles.push_back(c);
        out.degenerate.push_back(glm::cross(b - a, d - a) == glm::dvec3(0.0));
        if (out.degenerate.back()) continue;
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t from = c[k], to = c[(k + 1) % 3];
            halves.push_back({std::min(from, to), std::max(from, to), t, from < to});
        }
    }
    std::ranges::sort(halves, [](const HalfEdge& a, const HalfEdge& b) {
        return std::tie(a.from, a.to, a.triangle) < std::tie(b.from, b.to, b.triangle);
    });
    std::vector<std::uint32_t> parent(out.triangles.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](std::uint32_t t) {
        while (parent[t] != t) t = parent[t] = parent[parent[t]];
        return t;
    };
    for (const HalfEdge& half : halves) {
        const auto use = static_cast<std::uint32_t>(out.uses.size());
        if (out.edges.empty() || out.edges.back().from != half.from || out.edges.back().to != half.to) {
            out.edges.push_back({half.from, half.to, use, use});
        } else {
            const std::uint32_t a = root(out.uses.back().triangle), b = root(half.triangle);
            parent[std::max(a, b)] = std::min(a, b);
        }
        out.uses.push_back({half.triangle, half.forward});
        out.edges.back().end = use + 1;
    }
    out.component.resize(out.triangles.size());
    for (std::uint32_t t = 0; t < out.triangles.size(); ++t) {
        if (out.degenerate[t]) continue;
        const std::uint32_t r = root(t);
        out.component[t] = r == t ? out.components++ : out.component[r];
    }
    return out;
}

}  // namespace umbriel::visibility
