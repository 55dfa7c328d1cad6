#pragma once

#include <span>
#include <vector>

#include "common/image/image.h"
#include "common/image/spread.h"

namespace umbriel {

// Mach bands: the eye exaggerates where brightness changes its slope. The textbook's model of the retina (Mach 1865;
// lateral inhibition): every receptor passes on its value minus 10 % of the value of each neighbour. At the ends the
// last value goes on.

constexpr float kInhibition = 0.1F;

// A row of receptors, two neighbours each: 10 10 10 30 30 30 becomes 8 8 6 26 24 24.
std::vector<float> retinaRow(std::span<const float> row);

// The same over a picture of one channel, where every receptor has four neighbours (left, right, above, below): a flat
// grey v becomes 0.6 v, and a picture that changes along one axis only shows the bands of the row above, minus 0.2 v.
// What goes beyond 0.6 v is -0.1 times the discrete Laplacian: the overshoot that is seen as a band.
FloatImage retinaImage(const FloatImage& grey);

// How differently two pictures reach the brain, over display greys (grey.h) in [0, 1].
struct MachBandDifference {
    // |retina(A) - retina(B)|.
    Spread response;
    // Of it, what comes from changes of slope alone: 0.1 |Laplacian(A) - Laplacian(B)|. Kinks that shading by
    // interpolation makes show here although the greys themselves hardly differ.
    Spread overshoot;
};

// Both pictures of one size, one channel, finite (asserted: size and channels).
MachBandDifference machBandDifference(const FloatImage& greyA, const FloatImage& greyB);

}  // namespace umbriel
