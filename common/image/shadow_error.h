#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/image/mach_bands.h"
#include "common/image/spread.h"

namespace umbriel {

// How wrong shadows are. A factor is the share of a light that arrives at a pixel: 1 lit, 0 dark. `truth` and `result`
// are factors of one picture, top row first, `judged` marks (not 0) the pixels that count; all of width * height.
struct ShadowFactors {
    int width = 0;
    int height = 0;
    std::span<const float> truth;
    std::span<const float> result;
    std::span<const std::uint8_t> judged;
};

// What counts as away from an edge.
struct ShadowErrorOptions {
    // A pixel is away from the true shadow's edges when none passes within this many pixels.
    double awayPixels = 2.0;
};

// Shares are of the judged pixels (of those away from edges where it says so); 0 when there are none.
struct ShadowError {
    std::uint64_t judged = 0;
    // Light where there should be shadow, and shadow where there should be light: every pixel counts with the part of
    // the light that is wrong, which is 1 where both are hard.
    double leak = 0.0;
    double acne = 0.0;
    std::uint64_t judgedAway = 0;
    double leakAway = 0.0;
    double acneAway = 0.0;
    double rmse = 0.0;
    // Pixels on the other side of 1/2 than the truth.
    double wrongSide = 0.0;

    // The mean absolute error.
    double error() const { return leak + acne; }
    double errorAway() const { return leakAway + acneAway; }
};
ShadowError shadowError(const ShadowFactors& factors, const ShadowErrorOptions& options = {});

// Distances in pixels between where the two cross 1/2: from each place in either to the nearest in the other. A place
// is the border between two judged neighbours on different sides, so distances come in steps of half a pixel and an
// edge that has not moved is at 0.
struct ShadowEdges {
    std::uint64_t inTruth = 0;  // places
    std::uint64_t inResult = 0;
    // Infinite when only one of them has an edge.
    Spread distance;
};
ShadowEdges shadowEdges(const ShadowFactors& factors);

// Pairs of judged pixels on both sides of a tile's border which are equal in truth and differ by more than 1/2 in the
// result. Tiles as gridTiles() cuts them: column i begins at floor(i width / columns), rows from below.
struct SeamJump {
    std::uint64_t pairs = 0;  // equal in truth
    std::uint64_t jumps = 0;
    double share() const { return pairs == 0 ? 0.0 : static_cast<double>(jumps) / static_cast<double>(pairs); }
};
SeamJump seamJump(const ShadowFactors& factors, int columns, int rows);

// The same surface points seen twice: by two eyes, or in two frames. matches: for each pixel of the first picture the
// pixel of the second one, or kUnmatched. Pairs that both pictures judge count.
inline constexpr std::uint32_t kUnmatched = std::numeric_limits<std::uint32_t>::max();
// How factors of the same surface points differ between two pictures.
struct SurfaceChange {
    std::uint64_t pairs = 0;
    double mean = 0.0;     // of the absolute difference
    double changed = 0.0;  // share of pairs that differ by more than 1/2
};
SurfaceChange surfaceChange(std::span<const float> first, std::span<const float> second,
                            std::span<const std::uint32_t> matches, std::span<const std::uint8_t> judgedFirst,
                            std::span<const std::uint8_t> judgedSecond);

// Rivalry: the share of points that one picture shows on another side of 1/2 than all the pixels around their place in
// the other one. Neighbours of a shadow's edge fall to its one side or the other by chance in each picture, which this
// leaves out: no state between the two can be seen where the edge runs through the pixels around. around: up to four
// pixels of the second picture for each one of the first, kUnmatched for none. Points count whose first entry is there
// and whose pixels are all judged.
struct SurfaceRivalry {
    std::uint64_t points = 0;
    std::uint64_t rivals = 0;
    double share() const { return points == 0 ? 0.0 : static_cast<double>(rivals) / static_cast<double>(points); }
};
SurfaceRivalry surfaceRivalry(std::span<const float> first, std::span<const float> second,
                              std::span<const std::array<std::uint32_t, 4>> around,
                              std::span<const std::uint8_t> judgedFirst, std::span<const std::uint8_t> judgedSecond);

// What a retina makes of the difference, where pixels that are not judged show the truth in both pictures.
MachBandDifference shadowMachBands(const ShadowFactors& factors);

// CIE 1976 difference of the two seen as greys of that linear luminance, over the judged pixels; about 2.3 is just
// noticeable.
Spread shadowDeltaE(const ShadowFactors& factors);

}  // namespace umbriel
