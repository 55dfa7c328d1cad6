#pragma once

#include <string>

#include "client/import/import_error.h"
#include "client/import/import_limits.h"
#include "common/scene/animation.h"
#include "common/scene/aspect.h"

namespace umbriel {

// Builds the scene of a Wavefront .obj file with its .mtl libraries in an empty aspect: a node for each object or
// group, a geometry for each of its materials, Blinn-Phong materials, two-sided as OBJ knows no back faces. Runs in the
// import process. With limits.verticesAsWritten one geometry without materials instead. Throws ImportRefused, and std::bad_alloc.
Ref<LoadedScene> importObj(const std::string& file, Aspect& scene, const ImportLimits& limits,
                           ImportWarnings& warnings);

}  // namespace umbriel
