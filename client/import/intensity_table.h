#pragma once

#include "client/import/photometric_import.h"
#include "common/scene/aspect.h"
#include "common/scene/lights.h"

namespace umbriel {

// The intensities of a luminaire as the regular table that lights use. Steps are the smallest of the file where they
// divide the circle, so the usual files lose nothing; at most 1440 columns (0.25 degrees) and 1441 rows (0.125). A
// luminaire that is the same all around gets one column. Of a dark one all shares are 0.
Ref<IntensityTable> createIntensityTable(Aspect& scene, const PhotometricImport& luminaire);

}  // namespace umbriel
