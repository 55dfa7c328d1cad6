#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/visibility/mesh.h"
#include "common/visibility/mesh_topology.h"

namespace umbriel::visibility {

// An edge of triangle `s` passes through the inside of triangle `t`. Touching does not count, nor do edges that share a
// corner with `t`. Both have an area.
bool pierces(const std::vector<glm::vec3>& positions, const MeshTopology& topology, std::uint32_t s, std::uint32_t t);

// Triangles of a mesh that pass through each other.
struct FacePiercings {
    std::uint64_t count = 0;                                        // pairs of triangles of which one pierces the other
    std::vector<std::pair<std::uint32_t, std::uint32_t>> examples;  // the first in order, the lower triangle first
};

// All pairs of triangles with an area, without looking at all pairs: where many triangles surround one vertex, too.
FacePiercings facePiercings(const std::vector<glm::vec3>& positions, const MeshTopology& topology,
                            std::size_t examples);

}  // namespace umbriel::visibility
