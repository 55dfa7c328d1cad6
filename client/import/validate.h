#pragma once

#include <cstdint>

#include "client/import/import_limits.h"
#include "common/base/result.h"
#include "common/scene/animation.h"
#include "common/scene/aspect.h"

namespace umbriel {

// What walking over a scene's nodes may cost.
struct TreeLimits {
    std::uint32_t depth = 0;    // of nodes below each other
    std::uint64_t stepsUp = 0;  // nodes above joints, lights' and cameras' beacons, counted for each of these
};
// Of a scene that an importer builds within these limits: nodes, above them the lights, below them leaves with
// geometry.
TreeLimits treeLimits(const ImportLimits& limits);

// Whether an aspect holds a scene as an importer builds it, and nothing else: known types, references to what they
// should refer to, a tree of nodes within its limits, finite numbers, indices within their vertices, attributes and
// images of the right size, ascending animation keys, cameras and lights within their ranges. What passes cannot break
// the client or a server, whoever made it.
Result<void> validateLoadedScene(const Aspect& scene, Ref<LoadedScene> loaded, const TreeLimits& limits);

}  // namespace umbriel
