#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/trade/shadow_truth.h"
#include "common/image/image.h"
#include "common/image/shadow_error.h"

namespace umbriel {

// One way to draw shadows.
struct TradeSetting {
    std::string technique;         // short name of a ShadowMode, with ":scene" or ":per-view" for another fit,
                                   // or ":pcf" and others for what a light map is baked from
    std::uint32_t mapSize = 512;   // texels
    std::optional<double> filter;  // filterWidth; none: the module's own
    std::optional<int> samples;    // samplesPerRow
    std::vector<std::pair<std::string, std::string>> fields;  // further fields of the viewport
    bool hasMap = true;                                       // false: mapSize says nothing, and is not shown
};
// "lisp 1024", "pcf 1024 w8 n6", "zfail".
std::string labelOf(const TradeSetting& setting);

// What a frame of a setting costs.
struct TradeCost {
    double wallMilliseconds = 0.0;  // the slowest server's, median over frames
    double cpuMilliseconds = 0.0;   // all servers' threads together, median
    double gpuMilliseconds = 0.0;   // 0: not measured
    std::uint64_t mapBytes = 0;     // of the server that holds most
    int frames = 0;
    // Against the first setting of the same run, frame by frame beside it: median of ratios of processor time.
    double cpuRatio = 1.0;
};

// How a setting's picture differs from the truth; shares are of the judged pixels where nothing else is said.
struct TradeErrors {
    ShadowError error;
    ShadowEdges edges;
    // Of planar modes, judged on their plane alone: the error over all that other modes are judged by.
    std::optional<double> errorEverywhere;
    // Leaks and acne that no texel of this map excuses (of a PCF filter: no texel of its width), as shares of the judged
    // pixels; none where there is no map, or truth is soft.
    std::optional<double> leakBeyondTexel;
    std::optional<double> acneBeyondTexel;
    double machBand = 0.0;                             // mean response
    double deltaE = 0.0;                               // mean
    double seamJump = 0.0;                             // share of pairs across tile borders
    std::array<double, 3> zoneErrors{};                // near, middle, far
    std::array<std::optional<double>, 3> zoneEdges{};  // mean displacement, pixels; none without an edge
    // Of dark pixels of each zone the share that is lit: 1 where shadows vanish.
    std::array<std::optional<double>, 3> zoneMissing{};
    // The side of a texel on the picture, pixels: the median of each zone's judged pixels; none without a map.
    std::array<std::optional<double>, 3> zoneTexels{};
    std::optional<double> texelMetres;  // seen along the light, the median of all judged pixels
    std::optional<double> flicker;  // mean change of the same surface points from frame to frame, less the truth's
    std::optional<double>
        eyeMismatch;  // share of surface points that the eyes see on different sides, less the truth's
};

// One setting that was measured.
struct TradeRow {
    TradeSetting setting;
    TradeErrors errors;
    TradeCost cost;
    // What it was drawn with, where the technique has it, whether the setting says so or not.
    std::optional<double> filterWidth;  // texels
    std::optional<int> filterSamples;   // along each side of the filter
    FloatImage factors;                 // of the first light, one channel; for thumbnails
    // Where the first light is judged: planar modes on their plane alone. Empty: as the result says.
    std::vector<std::uint8_t> judged;
    bool onFront = false;
    bool chosen = false;
};

// A sweep over settings of one scene, and how it was judged.
struct TradeResult {
    std::string scene;
    std::string machine;  // renderer, processor
    std::string version;
    int width = 0;
    int height = 0;
    double judgedShare = 0.0;  // of covered pixels, over all lights
    std::string truth;         // how it was made, for people
    FloatImage truthFactors;   // of the first light
    std::vector<std::uint8_t> judged;
    std::vector<TradeRow> rows;
    std::vector<std::string> notes;
};

// What rows are compared by: over the same pixels, whatever they are judged by.
double comparedError(const TradeRow& row);

// Indices of rows that no other row beats: no more error and no more cost, and less of one. Ascending by processor
// time.
std::vector<std::size_t> paretoFront(const std::vector<TradeRow>& rows);

// The cheapest row whose error is at most maxError, and/or the most accurate that costs at most budget milliseconds of
// wall time; with both, the cheapest within both. None when nothing fits.
std::optional<std::size_t> choose(const std::vector<TradeRow>& rows, std::optional<double> maxError,
                                  std::optional<double> budgetMilliseconds);

}  // namespace umbriel
