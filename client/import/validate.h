#pragma once

#include <cstdint>

#include "common/base/result.h"
#include "common/scene/animation.h"
#include "common/scene/aspect.h"

namespace umbriel {

// Whether an aspect holds a scene as an importer builds it, and nothing else: known types, references to what they
// should refer to, a tree of nodes at most maxDepth deep, finite numbers, indices within their vertices, attributes and
// images of the right size, ascending animation keys, cameras and lights within their ranges. What passes cannot break
// the client or a server, whoever made it.
Result<void> validateLoadedScene(const Aspect& scene, Ref<LoadedScene> loaded, std::uint32_t maxDepth);

}  // namespace umbriel
