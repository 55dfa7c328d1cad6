#include "common/visibility/mesh_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "common/base/assert.h"
#include "common/trace/double_hit.h"
#include "common/visibility/box_grid.h"
#include "common/visibility/face_piercings.h"
#include "common/visibility/mesh_topology.h"

namespace umbriel::visibility {
namespace {

constexpr std::size_t kExamples = 5;
constexpr std::size_t kSamples = 8;  // triangles that tell where a component is

struct Counter {
    MeshFinding finding;
    void add(std::string example) {
        if (finding.count++ < kExamples) finding.examples.push_back(std::move(example));
    }
};

// Two triangles, wound to different sides. Other edges are open or shared by more.
bool isInconsistent(const MeshTopology& topology, const MeshTopology::Edge& e) {
    return e.end - e.begin == 2 && topology.uses[e.begin].forward == topology.uses[e.begin + 1].forward;
}

std::string describe(const glm::vec3& p) {
    return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z);
}

class Checker {
 public:
    Checker(const Mesh& mesh, const MeshCheckOptions& options)
        : _mesh(mesh), _options(options), _topology(topology(mesh)) {
        glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
        for (const glm::vec3& p : mesh.positions) {
            low = glm::min(low, glm::dvec3(p));
            high = glm::max(high, glm::dvec3(p));
        }
        _diagonal = glm::length(high - low);
    }

    MeshReport run() {
        MeshReport report;
        report.vertices = _mesh.positions.size();
        report.triangles = _mesh.indices.size() / 3;
        report.components = _topology.components;
        Counter open{
            {"open-edges", "inside and outside cannot be told apart; both sides need maps (mapping cube)", 0, {}}};
        Counter many{{"non-manifold-edges", "more than two triangles meet; normals there are a mean of all", 0, {}}};
        Counter winding{{"inconsistent-winding", "normals point to different sides; orient the mesh", 0, {}}};
        for (const MeshTopology::Edge& e : _topology.edges) {
            const std::uint32_t uses = e.end - e.begin;
            const MeshTopology::Use& first = _topology.uses[e.begin];
            const auto where = [&] {
                return fmt::format("vertices {} and {} of triangle {}", e.from, e.to, first.triangle);
            };
            if (uses == 1) {
                open.add(where());
                _openEdges.push_back(&e);
                _isOpen.insert(_topology.component[first.triangle]);
            } else if (uses > 2) {
                many.add(where() + fmt::format(" and {} more", uses - 1));
            } else if (isInconsistent(_topology, e)) {
                winding.add(fmt::format("triangles {} and {}", first.triangle, _topology.uses[e.begin + 1].triangle));
            }
        }
        report.closed = open.finding.count == 0;
        report.findings = {
            intersections(),
            open.finding,
            many.finding,
            cracks(),
            duplicates(),
            innerComponents(),
            winding.finding,
            MeshFinding{"polygons", "faces that are no triangles were split into some", _options.polygons, {}},
            unused(),
            degenerate(),
            MeshFinding{"non-finite-coordinates", "such a mesh is refused", 0, {}}};
        return report;
    }

 private:
    const Mesh& _mesh;
    const MeshCheckOptions& _options;
    MeshTopology _topology;
    double _diagonal = 0.0;
    std::vector<const MeshTopology::Edge*> _openEdges;
    std::set<std::uint32_t> _isOpen;  // components

    glm::dvec3 at(std::uint32_t vertex) const { return glm::dvec3(_mesh.positions[vertex]); }
    Box boxOf(std::uint32_t t) const {
        const glm::uvec3& c = _topology.triangles[t];
        return {glm::min(glm::min(at(c.x), at(c.y)), at(c.z)), glm::max(glm::max(at(c.x), at(c.y)), at(c.z))};
    }

    MeshFinding intersections() const {
        Counter found{{"intersecting-faces", "one part of a triangle is inside, colours bleed across the cut", 0, {}}};
        const FacePiercings piercings = facePiercings(_mesh.positions, _topology, kExamples);
        for (const auto& [s, t] : piercings.examples) found.add(fmt::format("triangles {} and {}", s, t));
        found.finding.count = piercings.count;
        return found.finding;
    }

    // A vertex of an open edge near, but not on, an open edge it is no end of.
    MeshFinding cracks() const {
        Counter found{{"cracks", "open edges lie side by side: normals and shadows break there; weld the mesh", 0, {}}};
        const double tolerance = _options.crackShare * _diagonal;
        std::vector<Box> boxes;
        std::set<std::uint32_t> boundary;
        for (const MeshTopology::Edge* e : _openEdges) {
            const glm::dvec3 pad(tolerance);
            boxes.push_back({glm::min(at(e->from), at(e->to)) - pad, glm::max(at(e->from), at(e->to)) + pad});
            boundary.insert({e->from, e->to});
        }
        const BoxGrid grid(boxes);
        for (const std::uint32_t v : boundary) {
            std::uint32_t nearest = ~0u;
            grid.eachOverlap({at(v), at(v)}, [&](std::uint32_t i) {
                const MeshTopology::Edge& e = *_openEdges[i];
                if (e.from == v || e.to == v) return;
                const glm::dvec3 along = at(e.to) - at(e.from);
                const double s = std::clamp(glm::dot(at(v) - at(e.from), along) / glm::dot(along, along), 0.0, 1.0);
                if (glm::length(at(v) - at(e.from) - along * s) <= tolerance) nearest = std::min(nearest, i);
            });
            if (nearest != ~0u) {
                const MeshTopology::Edge& e = *_openEdges[nearest];
                found.add(fmt::format("vertex {} beside the edge of vertices {} and {}", v, e.from, e.to));
            }
        }
        return found.finding;
    }

    MeshFinding duplicates() const {
        Counter found{{"duplicate-vertices", "corners at one position share a map; nothing is lost", 0, {}}};
        for (std::uint32_t v = 0; v < _topology.positionOf.size(); ++v) {
            if (_topology.positionOf[v] != v) {
                found.add(
                    fmt::format("vertices {} and {} at {}", _topology.positionOf[v], v, describe(_mesh.positions[v])));
            }
        }
        return found.finding;
    }

    // A ray from the middle of the triangle leaves through an odd number of the others.
    bool isInside(std::uint32_t triangle, const std::vector<std::uint32_t>& closed) const {
        // No symmetry of a mesh is likely to put an edge in this direction's way.
        const glm::dvec3 direction(0.5283, 0.3517, 0.7729);
        const glm::uvec3& c = _topology.triangles[triangle];
        const glm::dvec3 from = (at(c.x) + at(c.y) + at(c.z)) / 3.0;
        bool inside = false;
        for (const std::uint32_t t : closed) {
            const glm::uvec3& o = _topology.triangles[t];
            if (trace::hitDistance(direction, at(o.x) - from, at(o.y) - from, at(o.z) - from)) inside = !inside;
        }
        return inside;
    }

    // A component inside a closed one.
    MeshFinding innerComponents() const {
        Counter found{{"inner-components", "parts inside others are never lit and only cost time", 0, {}}};
        if (_topology.components < 2) return found.finding;
        std::vector<std::vector<std::uint32_t>> members(_topology.components);
        std::vector<Box> boxes(_topology.components, Box{glm::dvec3(std::numeric_limits<double>::infinity()),
                                                         glm::dvec3(-std::numeric_limits<double>::infinity())});
        for (std::uint32_t t = 0; t < _topology.triangles.size(); ++t) {
            if (_topology.degenerate[t]) continue;
            const std::uint32_t c = _topology.component[t];
            const Box box = boxOf(t);
            members[c].push_back(t);
            boxes[c].low = glm::min(boxes[c].low, box.low);
            boxes[c].high = glm::max(boxes[c].high, box.high);
        }
        const BoxGrid grid(boxes);
        for (std::uint32_t inner = 0; inner < _topology.components; ++inner) {
            const std::uint32_t triangle = members[inner].front();
            std::uint32_t around = ~0u;
            grid.eachOverlap(boxes[inner], [&](std::uint32_t outer) {
                const bool within = glm::all(glm::lessThanEqual(boxes[outer].low, boxes[inner].low)) &&
                                    glm::all(glm::lessThanEqual(boxes[inner].high, boxes[outer].high));
                if (outer == inner || _isOpen.contains(outer) || !within || outer > around) return;
                // A few triangles over the whole component: one that is outside is enough to say no.
                bool allInside = true;
                for (std::size_t i = 0; i < kSamples && allInside; ++i) {
                    allInside = isInside(members[inner][i * members[inner].size() / kSamples], members[outer]);
                }
                if (allInside) around = outer;
            });
            if (around != ~0u) {
                found.add(fmt::format("the {} triangles with triangle {} inside those with triangle {}",
                                      members[inner].size(), triangle, members[around].front()));
            }
        }
        return found.finding;
    }

    MeshFinding unused() const {
        Counter found{{"unused-vertices", "they get no map", 0, {}}};
        std::vector<bool> used(_mesh.positions.size(), false);
        for (const std::uint32_t v : _mesh.indices) used[v] = true;
        for (std::uint32_t v = 0; v < used.size(); ++v) {
            if (!used[v]) found.add(fmt::format("vertex {} at {}", v, describe(_mesh.positions[v])));
        }
        return found.finding;
    }

    MeshFinding degenerate() const {
        Counter found{{"degenerate-faces", "triangles without area are left out", 0, {}}};
        for (std::uint32_t t = 0; t < _topology.triangles.size(); ++t) {
            if (_topology.degenerate[t]) {
                found.add(fmt::format("triangle {} of vertices {}, {}, {}", t, _mesh.indices[3 * t],
                                      _mesh.indices[3 * t + 1], _mesh.indices[3 * t + 2]));
            }
        }
        return found.finding;
    }
};

}  // namespace

const MeshFinding& MeshReport::finding(const std::string& condition) const {
    const auto found = std::ranges::find(findings, condition, &MeshFinding::condition);
    UMBRIEL_ASSERT(found != findings.end(), "a condition of the list");
    return *found;
}

Result<MeshReport> checkMesh(const Mesh& mesh, const MeshCheckOptions& options) {
    if (const auto valid = checkIndices(mesh); !valid) return valid.error();
    const std::vector<std::uint32_t> bad = nonFinite(mesh);
    if (bad.empty()) return Checker(mesh, options).run();
    // Nothing else can be said about such a mesh.
    MeshReport report = Checker(Mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2}}, options).run();
    for (MeshFinding& finding : report.findings) {
        if (finding.condition != "polygons") finding.count = 0;
        finding.examples.clear();
    }
    report.vertices = mesh.positions.size();
    report.triangles = mesh.indices.size() / 3;
    report.components = 0;
    report.closed = false;
    report.findings.back().count = bad.size();
    for (std::size_t i = 0; i < std::min(bad.size(), kExamples); ++i) {
        report.findings.back().examples.push_back(
            fmt::format("vertex {} at {}", bad[i], describe(mesh.positions[bad[i]])));
    }
    return report;
}

std::uint64_t inconsistentEdges(const Mesh& mesh) {
    if (!checkIndices(mesh) || !nonFinite(mesh).empty()) return 0;
    const MeshTopology topo = topology(mesh);
    return static_cast<std::uint64_t>(
        std::ranges::count_if(topo.edges, [&](const MeshTopology::Edge& e) { return isInconsistent(topo, e); }));
}

std::string toText(const MeshReport& report) {
    std::string text = fmt::format("{} vertices, {} triangles, {} components, {}\n", report.vertices, report.triangles,
                                   report.components, report.closed ? "closed" : "open");
    for (const MeshFinding& f : report.findings) {
        text += fmt::format("{:<24}{:>8}", f.condition, f.count);
        if (f.count > 0) text += fmt::format("  {}", f.meaning);
        text += '\n';
        for (const std::string& example : f.examples) text += fmt::format("    {}\n", example);
        if (f.count > f.examples.size() && !f.examples.empty()) {
            text += fmt::format("    and {} more\n", f.count - f.examples.size());
        }
    }
    return text;
}

}  // namespace umbriel::visibility
