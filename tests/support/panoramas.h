#pragma once

#include "common/light/environment.h"
#include "shaders/formula_cpp.h"

namespace umbriel {

// A panorama of 2 rows x rows texels whose radiance is a function of the direction (a unit dvec3) of each texel's
// centre.
template <class Radiance>
Panorama panoramaOf(int rows, Radiance&& radiance) {
    Panorama made{2 * rows, rows, {}};
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < 2 * rows; ++column)
            made.radiance.push_back(glm::vec3(
                radiance(formula_f64::directionFromLatLong({(column + 0.5) / (2 * rows), (row + 0.5) / rows}))));
    return made;
}

}  // namespace umbriel
