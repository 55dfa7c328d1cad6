#pragma once

#include <cstdint>

#include "common/image/edge_displacement.h"
#include "common/image/image.h"
#include "common/image/mach_bands.h"
#include "common/image/spread.h"

namespace umbriel {

// How the further measures of two pictures are taken.
struct PictureMeasureOptions {
    double exposure = 0.0;    // EV, before everything but the threshold
    double threshold = 0.01;  // of linear radiance
    EdgeOptions edges{};
};

// What measures.h does not say of two pictures: measures that look at more than one pixel, or at it as an eye does.
struct PictureMeasures {
    // Pixels of which any of R, G, B (linear, unexposed) differs by more than the threshold or is not finite in either
    // picture.
    std::uint64_t aboveThreshold = 0;
    EdgeDisplacement edges;
    MachBandDifference machBands;
    Spread deltaE;  // colour_difference.h
};

// Two pictures of one size (asserted).
PictureMeasures measurePictures(const FloatImage& a, const FloatImage& b, const PictureMeasureOptions& options = {});

}  // namespace umbriel
