#pragma once

#include <cstdint>
#include <vector>

#include "common/math/glm.h"

namespace umbriel::trace {

// A triangle whose edges are moved outwards, in its plane, by `margin`; needles become rectangles, as their tips would
// run away.
struct Enlarged {
    std::vector<glm::vec3> corners;       // three for each
    std::vector<std::uint32_t> original;  // which triangle it enlarges
    // A hit is surely one of the original when each of its barycentric coordinates in the enlarged triangle is at least
    // this; above 1: never sure.
    std::vector<float> sure;
};

void appendEnlarged(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, std::uint32_t original,
                    double margin, Enlarged& out);

}  // namespace umbriel::trace
