#pragma once

#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "common/visibility/mesh.h"

namespace umbriel::visibility {

// Who is beside whom, with equal positions taken as one point.
struct MeshTopology {
    struct Edge {
        std::uint32_t from = 0, to = 0;    // positions, from < to
        std::uint32_t begin = 0, end = 0;  // uses, in MeshTopology::uses
    };
    struct Use {
        std::uint32_t triangle = 0;
        bool forward = false;  // the triangle runs from `from` to `to`
    };
    std::vector<std::uint32_t> positionOf;  // of each vertex: the lowest vertex with its coordinates
    std::vector<glm::uvec3> triangles;      // over those; degenerate ones included
    std::vector<bool> degenerate;
    std::vector<Edge> edges;  // of triangles that are not degenerate; sorted
    std::vector<Use> uses;
    std::vector<std::uint32_t> component;  // of each triangle, by edges of two triangles or more
    std::uint32_t components = 0;
};

// Indices and coordinates must be sound: see the two below.
MeshTopology topology(const Mesh& mesh);
// Bad input: no triangles, indices out of range, not three for each triangle.
Result<void> checkIndices(const Mesh& mesh);
// Vertices whose coordinates are not finite.
std::vector<std::uint32_t> nonFinite(const Mesh& mesh);

}  // namespace umbriel::visibility
