#pragma once

#include <string>

#include "client/import/import_error.h"
#include "client/import/import_limits.h"
#include "common/scene/animation.h"
#include "common/scene/aspect.h"

namespace umbriel {

// Builds the scene of a .gltf or .glb file in an empty aspect: nodes, geometry, materials, textures, cameras, lights
// and animations of its default scene. Runs in the import process. Throws ImportRefused, and std::bad_alloc.
Ref<LoadedScene> importGltf(const std::string& file, Aspect& scene, const ImportLimits& limits,
                            ImportWarnings& warnings);

}  // namespace umbriel
