#pragma once

#include <filesystem>

#include "common/base/result.h"
#include "common/image/image.h"

namespace umbriel {

// Reads OpenEXR, PNG, JPEG or Radiance HDR, told apart by their first bytes, in this process: for files this program
// wrote itself. Radiance and JPEG pictures get alpha 1; JPEG samples are taken as sRGB, as PNG's are, so
// displayByte(sample, 1) is the code in the file. A JPEG's exposure, where its EXIF tells it, becomes the numbers
// `expTime` (seconds), `aperture` (f-number) and `isoSpeed`, OpenEXR's names for them. Bad input: no such file, not a
// regular file, none of the four, beyond the limits, malformed, cut off.
Result<LayeredImage> readImage(const std::filesystem::path& path, const ImageLimits& limits = {});

}  // namespace umbriel
