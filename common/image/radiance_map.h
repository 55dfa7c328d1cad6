#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/image/image.h"

namespace umbriel {

// Radiance from a series of photographs of one still scene, taken from one place with different exposure times.
// Debevec and Malik 1997, "Recovering High Dynamic Range Radiance Maps from Photographs". Nothing is aligned: the
// camera has to stand still.

// One photograph. `codes` are the 8-bit values as the camera wrote them: R, G, B interleaved, top row first.
struct Exposure {
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> codes;
    double seconds = 0.0;
};

constexpr int kCodes = 256;
constexpr int kMidCode = 128;

// g(z) = ln f^-1(z): the logarithm of the exposure (radiance times seconds) that gives code z. 0 at kMidCode, never
// falling.
using LogResponse = std::array<double, kCodes>;
// Red, green, blue. Each is 0 at kMidCode, as photographs alone do not tell the scales of the channels: what gives the
// code (128, 128, 128) is taken to be grey.
using CameraResponse = std::array<LogResponse, 3>;

// How a response curve is fitted (Debevec and Malik 1997).
struct ResponseOptions {
    // lambda of eq. 3: how much smoothness of the curve counts against the data, per pixel used as in the paper. The
    // default suits the number of pixels below; noise of some codes wants no more.
    double smoothness = 20.0;
    // How many pixels of the picture are used, on a regular lattice. All of them when there are fewer.
    std::size_t pixels = 20000;
};

// A camera's response curve, and how well the photographs agree with it; arrays are by channel, red first.
struct ResponseFit {
    CameraResponse response;
    // Root of the weighted mean square of what eq. 3 leaves: natural logarithm of exposure; 0.01 is 1 %.
    std::array<double, 3> residual{};
    // Codes that had to be moved so that the curve does not fall (pool adjacent violators).
    std::array<int, 3> raisedCodes{};
    std::size_t pixels = 0;  // used
};

// Solves eq. 3 for each channel: the least squares over pixels and photographs with hat weights, the unknown radiances
// eliminated exactly, so that 256 unknowns remain (Cholesky, in double; the same input gives the same bits). Codes that
// no pixel has are filled in by smoothness.
// Bad input: fewer than two photographs or than two different times, times that are not positive, unequal sizes, no
// pixel that is neither black nor white in two photographs.
Result<ResponseFit> fitResponse(std::span<const Exposure> exposures, const ResponseOptions& options = {});

// How a pixel's radiance comes from its codes.
enum class MergeRule {
    Weighted,  // eq. 6: the mean of ln E over the photographs, hat weights
    Nearest    // the photograph whose code is nearest to mid-range; of two, the longer one
};

// A pixel (each channel by itself) that is white or black in every photograph gets the radiance that the one nearest to
// mid-range allows; it is a bound, no measurement, and counted.
struct RadianceMap {
    // Linear; 1 is the radiance that gives kMidCode in one second. Alpha is 1.
    FloatImage rgba;
    std::uint64_t white = 0;  // pixels with a channel that no photograph is short enough for
    std::uint64_t black = 0;  // pixels with a channel that no photograph is long enough for
};

// `exposures` as fitResponse() accepts them (asserted).
RadianceMap mergeExposures(std::span<const Exposure> exposures, const CameraResponse& response, MergeRule rule);

}  // namespace umbriel
