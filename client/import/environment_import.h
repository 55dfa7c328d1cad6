#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/light/environment.h"

namespace umbriel {

// Reads a picture of everything around a point: EXR, Radiance, PNG or JPEG, twice as wide as high, its middle straight
// ahead; EXR files that say so with OpenEXR's `envmap` attribute (latlong or cube) are turned to that. Decodes in a
// child process: call it before there are threads. notes: what was repaired. Bad input: cannot be read, another
// shape, more than 16384 columns.
Result<Panorama> loadPanorama(const std::string& file, std::vector<std::string>& notes);

}  // namespace umbriel
