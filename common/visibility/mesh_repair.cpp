// weld() and orient() of mesh_check.h.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/visibility/box_grid.h"
#include "common/visibility/mesh_check.h"
#include "common/visibility/mesh_topology.h"

namespace umbriel::visibility {
namespace {

Result<void> sound(const Mesh& mesh) {
    if (const auto valid = checkIndices(mesh); !valid) return valid.error();
    if (const auto bad = nonFinite(mesh); !bad.empty()) {
        return badInput(fmt::format("{} vertices have coordinates that are not finite, the first is vertex {}",
                                    bad.size(), bad.front()));
    }
    return {};
}

}  // namespace

Result<Mesh> weld(const Mesh& mesh, double tolerance) {
    if (const auto valid = sound(mesh); !valid) return valid.error();
    if (!(tolerance >= 0.0 && std::isfinite(tolerance))) {
        return badInput(fmt::format("the tolerance {} for welding is not a length", tolerance));
    }
    std::vector<std::uint32_t> target = topology(mesh).positionOf;
    if (tolerance > 0.0) {
        std::vector<Box> boxes;
        for (const glm::vec3& p : mesh.positions) boxes.push_back({glm::dvec3(p), glm::dvec3(p)});
        const BoxGrid grid(std::move(boxes));
        std::vector<std::uint32_t> kept(target.size(), ~0u);
        for (std::uint32_t v = 0; v < target.size(); ++v) {
            const glm::dvec3 p(mesh.positions[v]);
            std::uint32_t nearest = v;
            grid.eachOverlap({p - tolerance, p + tolerance}, [&](std::uint32_t other) {
                // Only vertices that stay attract: chains do not collapse.
                if (other < nearest && kept[other] == other &&
                    glm::length(glm::dvec3(mesh.positions[other]) - p) <= tolerance) {
                    nearest = other;
                }
            });
            kept[v] = nearest;
        }
        target = std::move(kept);
    }
    Mesh out;
    std::vector<std::uint32_t> number(target.size(), ~0u);
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const glm::uvec3 t(target[mesh.indices[i]], target[mesh.indices[i + 1]], target[mesh.indices[i + 2]]);
        const glm::dvec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
        if (glm::cross(b - a, c - a) == glm::dvec3(0.0)) continue;
        for (int k = 0; k < 3; ++k) {
            if (number[t[k]] == ~0u) {
                number[t[k]] = static_cast<std::uint32_t>(out.positions.size());
                out.positions.push_back(mesh.positions[t[k]]);
            }
            out.indices.push_back(number[t[k]]);
        }
    }
    if (out.indices.empty()) return badInput("no triangle is left after welding; use a smaller tolerance");
    return out;
}

Result<Oriented> orient(const Mesh& mesh) {
    if (const auto valid = sound(mesh); !valid) return valid.error();
    const MeshTopology topo = topology(mesh);
    const auto count = static_cast<std::uint32_t>(topo.triangles.size());
    // Neighbours across edges of two triangles, and whether one must be turned against the other.
    struct Link {
        std::uint32_t triangle;
        bool turned;
    };
    std::vector<std::vector<Link>> links(count);
    std::vector<bool> open(topo.components, false);
    for (const MeshTopology::Edge& e : topo.edges) {
        if (e.end - e.begin == 1) open[topo.component[topo.uses[e.begin].triangle]] = true;
        if (e.end - e.begin != 2) continue;
        const MeshTopology::Use &a = topo.uses[e.begin], &b = topo.uses[e.begin + 1];
        links[a.triangle].push_back({b.triangle, a.forward == b.forward});
        links[b.triangle].push_back({a.triangle, a.forward == b.forward});
    }
    Oriented out{mesh, 0, 0};
    std::vector<std::uint8_t> state(count, 0);  // 0: not seen, 1: as it is, 2: turned
    for (std::uint32_t start = 0; start < count; ++start) {
        if (topo.degenerate[start] || state[start] != 0) continue;
        std::vector<std::uint32_t> patch{start};
        state[start] = 1;
        for (std::size_t i = 0; i < patch.size(); ++i) {
            for (const Link& link : links[patch[i]]) {
                const auto wanted = static_cast<std::uint8_t>(link.turned ? 3 - state[patch[i]] : state[patch[i]]);
                if (state[link.triangle] == 0) {
                    state[link.triangle] = wanted;
                    patch.push_back(link.triangle);
                }
            }
        }
        double volume = 0.0;
        std::size_t turned = 0;
        const glm::dvec3 base(mesh.positions[topo.triangles[start].x]);
        for (const std::uint32_t t : patch) {
            const glm::uvec3& c = topo.triangles[t];
            const double part =
                glm::dot(glm::dvec3(mesh.positions[c.x]) - base,
                         glm::cross(glm::dvec3(mesh.positions[c.y]) - base, glm::dvec3(mesh.positions[c.z]) - base));
            volume += state[t] == 2 ? -part : part;
            turned += state[t] == 2;
        }
        const bool other = open[topo.component[start]] ? 2 * turned > patch.size() : volume < 0.0;
        for (const std::uint32_t t : patch) {
            if ((state[t] == 2) == other) continue;
            std::swap(out.mesh.indices[3 * t + 1], out.mesh.indices[3 * t + 2]);
            ++out.flipped;
        }
    }
    for (const MeshTopology::Edge& e : topo.edges) {
        const MeshTopology::Use &a = topo.uses[e.begin], &b = topo.uses[e.end - 1];
        if (e.end - e.begin > 2) {
            ++out.unorientable;
        } else if (e.end - e.begin == 2 && (state[a.triangle] == state[b.triangle]) != (a.forward != b.forward)) {
            ++out.unorientable;
        }
    }
    return out;
}

}  // namespace umbriel::visibility
