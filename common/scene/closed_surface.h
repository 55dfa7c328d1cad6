#pragma once

#include <cstdint>
#include <span>

#include "common/math/glm.h"

namespace umbriel {

// True when every edge of the triangles has as many of them in one direction as in the other, equal positions taken as
// one point: the mesh bounds a body. indices: three for each triangle; triangles with an index beyond the positions, or
// with two corners in one place, do not count.
bool isClosedSurface(std::span<const glm::vec3> positions, std::span<const std::uint32_t> indices);

}  // namespace umbriel
