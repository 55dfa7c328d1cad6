#pragma once

#include "common/visibility/mapping.h"

namespace umbriel::visibility::octahedral {

// The whole sphere in one image s x s, in the mesh's own axes: (u, v) in [-1,1]^2 folded onto |x| + |y| + |z| = 1, the
// lower half to the corners (Cigolle et al. 2014). One set of directions serves every vertex and every normal of a
// crease, so no index maps are needed. With even s the folds cut pixels along their diagonal only.
glm::dvec3 direction(std::uint32_t s, std::uint32_t pixel);
std::optional<std::uint32_t> pixelOf(std::uint32_t s, const glm::dvec3& direction);
double cosineWeight(std::uint32_t s, std::uint32_t pixel);
double solidAngle(std::uint32_t s, std::uint32_t pixel);
double midpointCosineWeight(std::uint32_t s, std::uint32_t pixel);
double midpointSolidAngle(std::uint32_t s, std::uint32_t pixel);
glm::dvec3 vectorWeight(std::uint32_t s, std::uint32_t pixel);
std::vector<Neighbours> neighbours(std::uint32_t s);

}  // namespace umbriel::visibility::octahedral
