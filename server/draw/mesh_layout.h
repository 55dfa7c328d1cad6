#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/math/glm.h"
#include "common/scene/nodes.h"
#include "server/draw/culling.h"
#include "server/draw/facing.h"
#include "server/draw/solid_parts.h"

namespace umbriel {

// What is derived from a geometry before it goes to the GPU. Pure: no GL.

inline constexpr std::size_t kClusterTriangles = 16;
// Of solid parts: fewer, which face more alike.
inline constexpr std::size_t kSolidClusterTriangles = 16;
// Solid parts are sorted by where their triangles face until there are so many triangles. More would face more alike in
// a cluster, but lie further apart, and be cut by more frusta.
inline constexpr std::size_t kSortedTogether = 32;
// Below this, sorting gains nothing.
inline constexpr std::size_t kSortFromTriangles = 512;

// Consecutive triangles that are culled together.
struct Cluster {
    Box box;     // object space
    Box solids;  // where all its triangles are of solid parts: of these parts; else empty
    NormalCone normals;  // of its triangles, in object space, where they are all of solid parts
    std::uint32_t firstTriangle = 0;
    std::uint32_t triangles = 0;
};

// Consecutive clusters that are culled together first.
inline constexpr std::size_t kGroupClusters = 16;
struct ClusterGroup {
    Box box;     // object space
    Box solids;  // of its clusters'
    std::uint32_t firstCluster = 0;
    std::uint32_t clusters = 0;
};

// Triangles in the order they are drawn.
struct TriangleOrder {
    std::vector<std::uint32_t> indices;     // three a triangle
    std::vector<std::uint32_t> primitives;  // the number of each triangle in the scene's geometry; empty: unchanged
};

// Removes what no GPU should see: a component that is not finite becomes 0.
void sanitise(std::span<float> values);

// A triangle whose indices lie outside of vertexCount becomes a point, so that numbering stays. Sorted: along a space-
// filling curve through the centres, so that consecutive triangles are neighbours; deterministic.
TriangleOrder orderTriangles(std::span<const std::uint32_t> indices, std::span<const glm::vec3> positions, bool sorted);
// Moves the triangles of solid parts before the others, unless the order must stay; each of both keep theirs. parts: of
// order.indices, before and after.
void moveSolidsFirst(TriangleOrder& order, SolidParts& parts);
// Sorts the triangles of solid parts, which come first, so that clusters of them turn away together: parts along the
// curve, a few at a time; of these by the direction that they face. The sizes of the clusters, in order; none: nothing
// changed. Deterministic.
std::vector<std::uint32_t> sortSolidsByFacing(TriangleOrder& order, SolidParts& parts,
                                              std::span<const glm::vec3> positions);

// sizes: of the first clusters; the others are full.
std::vector<Cluster> clustersOf(std::span<const std::uint32_t> indices, std::span<const glm::vec3> positions,
                                std::span<const std::uint32_t> sizes = {});
// Finds the clusters that are all of solid parts, and where these face.
void markSolids(std::span<Cluster> clusters, const SolidParts& parts, std::span<const std::uint32_t> indices,
                std::span<const glm::vec3> positions);

std::vector<ClusterGroup> groupsOf(std::span<const Cluster> clusters);

// Unit normal of a triangle, counter-clockwise seen from its tip; (0, 0, 1) for a degenerate one. Computed in double:
// products of floats far apart overflow.
glm::vec3 faceNormal(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c);

// Tangents as MikkTSpace defines them (Mikkelsen 2008), in a simpler form: per triangle the direction in which u grows,
// weighted by the angle at the vertex, accumulated per vertex and made perpendicular to the normal; w is the sign of
// the bitangent. Vertices are not split, so tangents at mirrored texture seams average where MikkTSpace would separate
// them. normals empty: face normals are accumulated instead.
std::vector<glm::vec4> deriveTangents(std::span<const std::uint32_t> indices, std::span<const glm::vec3> positions,
                                      std::span<const glm::vec3> normals, std::span<const glm::vec2> texCoords);

}  // namespace umbriel
