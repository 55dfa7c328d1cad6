#pragma once

#include <vector>

#include "common/base/result.h"
#include "common/math/glm.h"

namespace umbriel {

// A measured isotropic BRDF: values on a grid over the two angles to the normal and the azimuth between the directions.
// Directions are local: unit vectors away from the surface, +Z the normal.
struct BrdfTable {
    // Radians, rising, within [0, pi / 2]; at least two each.
    std::vector<double> thetaIn;
    std::vector<double> thetaOut;
    // Azimuth between the directions, radians, rising, within [0, pi]: 0 is the side the light comes from, pi the side
    // a mirror sends it to. At least two. The other half is the mirror image.
    std::vector<double> phi;
    // 1/sr, linear R, G, B: values[(i * thetaOut.size() + j) * phi.size() + k].
    std::vector<glm::dvec3> values;

    const glm::dvec3& at(std::size_t i, std::size_t j, std::size_t k) const {
        return values[(i * thetaOut.size() + j) * phi.size() + k];
    }

    // Trilinear in the angles; beyond the grid its border goes on, below the surface it is 0.
    glm::dvec3 value(const glm::dvec3& inLocal, const glm::dvec3& outLocal) const;
};

// Bad input, in words, unless the table is as described: axes, number of values, every value finite and not negative.
Result<void> checkBrdfTable(const BrdfTable& table);

}  // namespace umbriel
