#pragma once

#include "common/light/environment.h"
#include "common/scene/aspect.h"
#include "common/scene/environment.h"

namespace umbriel {

// Prefilters a panorama into a container. faceSize: as prefilter().
Ref<EnvironmentMap> addEnvironmentMap(Aspect& scene, const Panorama& panorama, int faceSize = 0);

}  // namespace umbriel
