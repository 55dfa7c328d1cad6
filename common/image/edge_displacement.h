#pragma once

#include <cstdint>
#include <vector>

#include "common/image/image.h"
#include "common/image/spread.h"

namespace umbriel {

// What counts as an edge of a picture.
struct EdgeOptions {
    // Smallest step of display grey, in [0, 1], that is an edge: the gradient (Sobel, per pixel) a sharp step of twice
    // this height has.
    float threshold = 0.05F;
};

// Edge pixels, 1 or 0, top row first: the gradient of `grey` (Sobel 1968, 3 x 3, edge pixels repeated at the border) is
// at least the threshold and, along its direction (to the nearest of eight neighbours), nowhere larger beside it (Canny
// 1986, without hysteresis). Of the two equal gradients beside a sharp step the one towards the darker side counts, so
// an edge is one pixel wide.
std::vector<std::uint8_t> edgePixels(const FloatImage& grey, const EdgeOptions& options = {});

// Squared Euclidean distance from every pixel to the nearest marked one; infinity when none is marked. Exact and in
// linear time: Felzenszwalb and Huttenlocher 2012, "Distance Transforms of Sampled Functions".
std::vector<float> squaredDistances(const std::vector<std::uint8_t>& marked, int width, int height);

// How far the edges of one picture lie from those of another, in pixels: for every edge pixel the distance to the
// nearest edge pixel of the other. Whole pixels: an edge that moved by less than half a pixel has not moved. Not
// symmetric: an edge that the other picture does not have shows in one direction only.
struct EdgeDisplacement {
    std::uint64_t edgesA = 0;  // pixels
    std::uint64_t edgesB = 0;
    // All infinite when the other picture has no edge at all; all 0 when this one has none.
    Spread fromA;
    Spread fromB;
};

// Two pictures of one size (asserted), display grey (grey.h).
EdgeDisplacement edgeDisplacement(const FloatImage& greyA, const FloatImage& greyB, const EdgeOptions& options = {});

}  // namespace umbriel
