#pragma once

#include <optional>
#include <vector>

#include "common/scene/traversal.h"

namespace umbriel {

// The plane that planar shadows fall on when the viewport names none: of the flat faces with the scene on one side of
// them alone, the one with the largest area that a light shines on; (normal, offset) in world coordinates, the unit
// normal on the scene's side, normal . point + offset = 0. Nothing when no face faces a light. Cost: a look at every
// triangle.
std::optional<glm::dvec4> largestLitPlane(const Aspect& aspect, Ref<Node> root, const Box3d& sceneBounds,
                                          const std::vector<LightInEffect>& lights);

}  // namespace umbriel
