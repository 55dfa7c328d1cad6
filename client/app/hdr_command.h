#pragma once

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace umbriel {

// The command line of `umbriel hdr`: one radiance map of several exposures.
struct HdrOptions {
    // JPEG or PNG, 8 bits, one size, of one still scene from one place; any order.
    std::vector<std::filesystem::path> photographs;
    // Exposure times in seconds, one for each photograph in their order: "1/30,1/15,0.5". "@FILE" names a text file
    // with a line `NAME SECONDS` for each photograph ('#' begins a comment, further words are skipped). Empty: EXIF.
    std::string times;
    // .exr (32-bit float, the response curve as attributes), .hdr or .png (tone-mapped).
    std::vector<std::filesystem::path> outs;
    std::string merge = "weighted";        // or "nearest"
    double smoothness = 20.0;              // common/image/radiance_map.h
    std::string toneMapping = "reinhard";  // .png only: clamp, exposure, reinhard, aces
    std::optional<double> exposure;        // EV, .png only; none: the mean of the logarithms becomes 0.18
    bool json = false;
};

// `umbriel hdr`: a radiance map from a series of photographs, by Debevec and Malik (common/image/radiance_map.h).
// Radiance 1 gives code 128 in one second. The EXR's attributes are `umbriel.response.red`, `.green`, `.blue` (256
// numbers: the natural logarithm of the exposure behind each code), `umbriel.times` (seconds) and `umbriel.merge`.
//
// Prints a summary, or with `json` one object {size, photographs: [{file, seconds}], merge, smoothness, pixels_used,
// residual: [3], raised_codes: [3], white, black, radiance: {min, max, log_average}, exposure, hdr_repairs, files,
// response: {red, green, blue: [256]}}.
//
// Exit codes: 0 done; 2 bad input (unreadable or unequal pictures, more than 8 bits, missing times, aperture or ISO
// speed changing under EXIF times); 1 it could not be done. The message of 1 and 2 goes to `err`.
int runHdr(const HdrOptions& options, std::ostream& out, std::ostream& err);

}  // namespace umbriel
