#pragma once

#include <vector>

#include "common/math/glm.h"

namespace umbriel {

// How bright a luminaire is in each direction: luminous intensity over a grid of angles, as photometric files tabulate
// it (type C). In the light's frame the luminaire shines along -Z (nadir), C0 lies towards +X, C90 towards +Y, so that
// C turns anticlockwise when seen from +Z.
struct PhotometricWeb {
    // gamma, radians, rising, within [0, pi]: 0 is nadir (-Z), pi zenith. Outside what is given the luminaire is dark.
    std::vector<double> vertical;
    // C, radians, rising, from at most 0 to at least 2 pi: closed, whatever symmetry the file used. At least two.
    std::vector<double> horizontal;
    // Candela, not negative: horizontal.size() planes of vertical.size() values.
    std::vector<float> candela;

    float at(std::size_t plane, std::size_t angle) const { return candela[plane * vertical.size() + angle]; }

    // Bilinear between the four values around; any C is taken modulo 2 pi. NaN gives 0.
    double intensity(double gamma, double c) const;

    // Towards a direction in the light's frame, of any length but 0 (which gives 0).
    double intensityTowards(const glm::dvec3& directionLight) const;

    // Largest value of the table.
    double maxIntensity() const;

    // Lumens: intensity over the whole sphere. Exact for the bilinear surface in cos(gamma); the difference to bilinear
    // in gamma vanishes with the square of the step.
    double luminousFlux() const;

    // The table on a regular grid for a texture: `columns` values of C at 2 pi i / columns (wrapping), `rows` of gamma
    // at pi j / (rows - 1); row by row. rows >= 2, columns >= 1 (asserted).
    std::vector<float> resampled(std::size_t columns, std::size_t rows) const;
};

}  // namespace umbriel
