#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/math/glm.h"
#include "server/draw/culling.h"

namespace umbriel {

// Parts of a mesh that hide their own backs: closed, convex, and wound counter-clockwise seen from outside. A ray from
// outside meets a front face of such a part before any of its back faces, so these need not be drawn, whatever the
// material says: pictures keep their bits but for pixels on an outline, where rounding let a back win. That holds for
// every closed surface that does not run through itself; convexity is how it is known of these. Pure: no GL.
struct SolidParts {
    static constexpr std::uint32_t kNone = 0xffffffffu;
    std::vector<std::uint32_t> partOfTriangle;  // kNone: part of no solid; empty: there is none
    std::vector<Box> boxes;                     // by part
};

// Parts of more triangles count as no solids: telling takes the product of a part's triangles and vertices.
inline constexpr std::size_t kSolidTriangles = 1024;

// Vertices at the same place are one. Dents of up to a thousandth of a part's size count as rounding: only within that
// depth could it run through itself. indices: three a triangle, within positions.
SolidParts solidPartsOf(std::span<const std::uint32_t> indices, std::span<const glm::vec3> positions);

}  // namespace umbriel
