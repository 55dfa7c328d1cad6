#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/image/image.h"

namespace umbriel {

// How far a layer is the same in two pictures. Layers are paired by name and type.
struct LayerComparison {
    // OtherChannels: in both, with other channels or in another order (files have them sorted).
    enum class Presence { Both, OnlyA, OnlyB, OtherChannels };

    std::string name;
    bool isUint = false;
    Presence presence = Presence::Both;
    std::uint64_t bitDiffering = 0;  // pixels, as ImageComparison::bitDiffering; 0 unless Both
};

// Error measures between the RGBA of two pictures of one size.
struct ImageComparison {
    std::uint64_t pixels = 0;
    // Pixels of which any channel (R, G, B, A) differs after exposure, clamp, sRGB encoding and rounding to 8 bits
    // (display.h; alpha is clamped and rounded only), or of which any channel of either picture is NaN.
    std::uint64_t differing = 0;
    // Pixels of which any channel differs as 32 bits (so -0 differs from 0), or is NaN: even the same NaN in both.
    std::uint64_t bitDiffering = 0;
    // Pixels of which any 8-bit channel differs by more than 8 of 255; NaN shows as 0.
    std::uint64_t over8 = 0;
    // Pixels whose alpha is 0 in one picture only.
    std::uint64_t holes = 0;
    // Pixels with a NaN or an infinity in either picture; they are left out of max, mae and rmse.
    std::uint64_t nonFinite = 0;
    // Over the linear, unexposed R, G, B samples of all other pixels, in double: largest absolute difference, its
    // mean, and the root of the mean square. Alpha has its own counts above. 0 when no pixel is finite.
    double max = 0.0;
    double mae = 0.0;
    double rmse = 0.0;
    // Sorted by name. Filled by compareImages() only.
    std::vector<LayerComparison> layers;
};

// How two pictures are compared.
struct ComparisonOptions {
    double exposure = 0.0;  // EV, before `differing` and `over8`
};

// Bad input when the sizes differ or a picture is empty.
Result<ImageComparison> compareImages(const LayeredImage& a, const LayeredImage& b,
                                      const ComparisonOptions& options = {});

// The same for a rectangle with y from the TOP, inside both pictures (asserted); without layers.
ImageComparison compareRegion(const FloatImage& a, const FloatImage& b, const PixelRect& region,
                              const ComparisonOptions& options = {});

// One pixel that is not the same in both pictures.
struct PixelDifference {
    int x = 0;
    int y = 0;  // from the top
    std::array<float, 4> a{};
    std::array<float, 4> b{};
    bool hasNan = false;
    int bytes = 0;        // largest difference of an 8-bit channel
    double linear = 0.0;  // largest finite difference of R, G, B, A
};

// At most `count` of the pixels that bitDiffering counts, worst first: NaN, then by `bytes`, then by `linear`, then
// from the top left. For messages.
std::vector<PixelDifference> worstPixels(const FloatImage& a, const FloatImage& b, const PixelRect& region,
                                         std::size_t count, const ComparisonOptions& options = {});

}  // namespace umbriel
