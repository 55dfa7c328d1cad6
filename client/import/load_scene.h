#pragma once

#include <string>
#include <vector>

#include "client/import/import_limits.h"
#include "common/base/result.h"
#include "common/scene/animation.h"
#include "common/scene/aspect.h"

namespace umbriel {

// A scene that was loaded, and what there is to say about its file.
struct LoadedFile {
    Ref<LoadedScene> scene;
    std::vector<std::string> warnings;  // one line each, without the file's name
    std::uint64_t polygons = 0;         // faces of an .obj with more than three corners, split into triangles
};

// Loads a scene file (.gltf, .glb, .obj) into an aspect, for its next commit, with ids from the source. The file is
// parsed in a child process under limits, and its answer is validated here; on an error nothing has changed. Errors
// name the file and the place in it: bad input for what is wrong with the file, failure for what is wrong with the
// machine. Blocks until the file is loaded or limits.wallTime has passed.
Result<LoadedFile> loadScene(const std::string& file, Aspect& into, IdSource& ids, const ImportLimits& limits = {});

}  // namespace umbriel
