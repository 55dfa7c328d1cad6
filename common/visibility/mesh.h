#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/hash.h"
#include "common/base/result.h"
#include "common/math/glm.h"
#include "common/trace/direction_packets.h"
#include "common/trace/triangles.h"
#include "common/visibility/mapping.h"

namespace umbriel::visibility {

// A mesh as it was loaded: what a graphics API calls vertices, so the corners of a crease are several.
struct Mesh {
    std::vector<glm::vec3> positions;
    std::vector<std::uint32_t> indices;  // three for each triangle
};

inline constexpr std::uint32_t kNoRow = ~0u;

// What one visibility map belongs to: a position and a side of the surface.
struct Row {
    std::uint32_t position = 0;  // index into BakeMesh::positions
    // Angle-weighted mean over its triangles, unit length. Where triangles of one vertex face opposite ways, so that
    // nothing is left of the mean, the first one's.
    glm::vec3 normal{0, 0, 1};
};

// A mesh made ready for baking. Rows are along a Z-curve, so that rays of neighbours touch the same memory and shards
// are compact; the order, like everything here, depends on the mesh alone.
struct BakeMesh {
    std::vector<glm::vec3> positions;   // unique: equal coordinates are one point, -0 is 0
    std::vector<glm::uvec3> triangles;  // over positions; with three different corners and an area above zero
    std::vector<Row> rows;
    std::vector<std::uint32_t> vertexRow;   // for each loaded vertex; kNoRow where it has no triangle: unlit
    std::vector<std::uint32_t> ownBegin;    // triangles that have position p as a corner:
    std::vector<std::uint32_t> own;         // own[ownBegin[p]] to own[ownBegin[p + 1]]
    std::uint32_t degenerateTriangles = 0;  // left out
    std::uint32_t unlitVertices = 0;
    double diagonal = 0.0;  // of the box
    // Over the loaded positions and indices, and the rows with their normals.
    Hash128 hash;

    trace::Triangles view() const { return {positions, triangles}; }
    std::span<const std::uint32_t> ownTriangles(std::uint32_t position) const {
        return std::span(own).subspan(ownBegin[position], ownBegin[position + 1] - ownBegin[position]);
    }
};

// Bad input: no triangles, indices out of range or not three for each triangle, coordinates that are not finite or
// above 1e18 (their products would overflow), more than 2^31 indices.
Result<BakeMesh> prepare(const Mesh& mesh);

// The step between neighbouring coordinates (up to twice it) where the mesh is farthest from the origin, as a share of
// its diagonal, of all its vertices: how coarse its shape may have become by where it stands. Infinite for a single
// point away from the origin.
double coarseness(const Mesh& mesh);

// Axes of a vertex: z is the normal, x and y from it without a branch that jumps (Duff et al. 2017).
glm::mat3 vertexAxes(const glm::vec3& normal);
// Where rays of this row start, and the axes its directions refer to.
trace::Origin origin(const BakeMesh& mesh, std::uint32_t row, DirectionFrame frame);

// The mapping's directions, in single precision, as the makers use them.
trace::DirectionPackets directionPackets(const Mapping& mapping);
// Over those directions and their pixels: two maps with equal hashes asked the same rays.
Hash128 directionHash(const Mapping& mapping);

}  // namespace umbriel::visibility
