#pragma once

#include <filesystem>

#include "common/base/result.h"
#include "common/image/image.h"

namespace umbriel {

// Reads OpenEXR, PNG or Radiance HDR, told apart by their first bytes, in this process: for files this program wrote
// itself. Radiance pictures get alpha 1. Bad input: no such file, not a regular file, none of the three, beyond the
// limits, malformed.
Result<LayeredImage> readImage(const std::filesystem::path& path, const ImageLimits& limits = {});

}  // namespace umbriel
