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

// The plane with its normal on the side from which suns that cast shadows shine, where no light does from the other: a
// plane that somebody names has none. Else as it is.
glm::dvec4 towardsLights(const glm::dvec4& planeWorld, const std::vector<LightInEffect>& lights);

// Whether something of the box may lie on the plane (unit normal and offset, world), to a hundredth of its diagonal.
bool touches(const glm::dvec4& planeWorld, const Box3d& box);

}  // namespace umbriel
