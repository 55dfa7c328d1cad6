#pragma once

#include "common/visibility/mapping.h"

namespace umbriel::visibility::fibonacci {

// A spiral of equal cosine weights pi / P over the hemisphere: sin^2 of the polar angle is (k + 1/2) / P, the azimuth
// turns by the golden angle. Ambient occlusion is then a count of bits. Its gaps at the horizon reach 10 degrees at
// P = 1024: not for point lights.
glm::dvec3 direction(std::uint32_t count, std::uint32_t k);
std::optional<std::uint32_t> pixelOf(std::uint32_t count, const glm::dvec3& direction);

}  // namespace umbriel::visibility::fibonacci
