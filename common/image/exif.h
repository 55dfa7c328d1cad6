#pragma once

#include <filesystem>
#include <optional>

namespace umbriel {

// How a photograph was exposed, as far as its camera says so.
struct ExposureTags {
    std::optional<float> seconds;   // ExposureTime
    std::optional<float> aperture;  // FNumber
    std::optional<float> isoSpeed;  // ISOSpeedRatings
};

// The EXIF tags of a JPEG file; values that are missing, zero or no number are left out. Parses the file in this
// process: for files that others made call readImageIsolated(), which hands them on (image_reader.h).
ExposureTags readExposureTags(const std::filesystem::path& path);

}  // namespace umbriel
