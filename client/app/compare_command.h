#pragma once

#include <array>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>

namespace umbriel {

// The command line of `umbriel compare`: two pictures and how they are looked at.
struct CompareOptions {
    std::filesystem::path a;
    std::filesystem::path b;
    double exposure = 0.0;  // EV
    bool json = false;
    // Columns and rows: measure every tile of such a wall too.
    std::optional<std::array<int, 2>> grid;
    // "basic", or "all": those of common/image/picture_measures.h as well.
    std::string measures = "basic";
    double threshold = 0.01;  // of linear radiance, for the share above it
};

// `umbriel compare A B`: measures two pictures (EXR, PNG, JPEG or Radiance HDR) against each other
// (common/image/measures.h) and prints a table, or with `json` one object
//   {pixels, differing, bit_differing, over_8_255, holes, max, mae, rmse}
// with further keys only where there is something to say: `non_finite` (pixels) when not 0; `layers` when a picture has
// any: [{name, type: "float"|"uint", in: "both"|"a"|"b"|"other channels", bit_differing (in both)}]; `tiles` with a
// grid: [{column, row, x, y, width, height, and the eight measures}], columns and rows from the lower left, in wall
// pixels from there.
// With `measures` "all" also `above_threshold` {threshold, pixels, share}; `edge_displacement` {edges_a, edges_b,
// a_to_b, b_to_a: {mean, median, p95, max}, null where the other picture has no edge} in pixels; `mach_band` {mean,
// median, p95, max, overshoot: {the same}} of display grey 0..1; `delta_e` {mean, median, p95, max}.
//
// Exit codes: 0 the comparison was made, whatever it says; 2 bad input (no such file, not readable, unequal sizes, an
// impossible grid, exposure or threshold); 1 it could not be done. The message of 1 and 2 goes to `err`.
int runCompare(const CompareOptions& options, std::ostream& out, std::ostream& err);

}  // namespace umbriel
