#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/math/glm.h"

namespace umbriel {

// Who bounds whom among the triangles of a caster, with equal positions taken as one point; made once for a geometry
// and again when it changes.
struct CasterTopology {
    struct Edge {
        std::uint32_t from = 0, to = 0;    // vertices
        std::uint32_t begin = 0, end = 0;  // in CasterTopology::uses
    };
    struct Use {
        std::uint32_t triangle = 0;
        bool forward = false;  // the triangle runs from `from` to `to`
    };
    // Vertices are the geometry's; of several with one position, the first.
    std::vector<glm::uvec3> triangles;  // without those that are a point or a line of equal vertices
    std::vector<Edge> edges;            // sorted
    std::vector<Use> uses;
    // Every edge has as many triangles in one direction as in the other: the mesh bounds a body, and what faces the
    // light is all that need cast. An open one casts with both sides.
    bool isClosed = false;
};

// indices: three for each triangle; a triangle with an index beyond the positions is left out.
CasterTopology casterTopology(std::span<const glm::vec3> positions, std::span<const std::uint32_t> indices);

// A caster as its volumes are made from it.
struct CasterShape {
    std::vector<glm::vec3> positions;
    CasterTopology topology;
};

// Marks a corner that stands at infinity, straight away from the light.
inline constexpr std::uint32_t kExtruded = 0x80000000u;

// The shadow of a caster as a closed surface, for counting in the stencil buffer (Crow 1977; Everitt & Kilgard 2002):
// three corners for each triangle, a vertex each, counter-clockwise from outside. All of one body, whatever the mesh:
// an edge gets as many sides as the triangles along it do not cancel, so holes, fans of three triangles at an edge and
// overlapping sheets keep the count right.
struct ShadowVolume {
    std::vector<std::uint32_t> sides;     // from the edges of what faces the light to infinity
    std::vector<std::uint32_t> lightCap;  // the triangles that cast
    std::vector<std::uint32_t> darkCap;   // those at infinity; none when its sides meet in a point
};

// lightObject: in the mesh's space; w 1: a position, w 0: the direction towards it. caps: false leaves both out, as
// counting what lies before the surface (z-pass) needs none. finite: it will end at a finite distance, where the sides
// of a directional light do not meet. A triangle seen edge-on casts nothing; decided in double once for each triangle,
// so neighbours agree.
ShadowVolume shadowVolume(const CasterTopology& topology, std::span<const glm::vec3> positions,
                          const glm::dvec4& lightObject, bool caps, bool finite = false);

}  // namespace umbriel
