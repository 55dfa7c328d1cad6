#pragma once

#include <span>
#include <string>
#include <vector>

#include "client/session/shadow_fit.h"
#include "common/scene/light_map_state.h"

namespace umbriel {

// What of a viewport's light map is true in the scene as it is now.
struct LightMapUse {
    const LightMap* map = nullptr;  // null: there is none, or it is stale
    bool hasOthers = false;         // something is drawn that is not in the map: what moves
    std::vector<std::string> messages;
};

// A map is stale when a surface it was baked of does not stand where it did, or has another shape or other holes, or is
// excluded: then none of its lights is looked up. What else is drawn, animated or not, counts as moving.
LightMapUse useLightMap(const Aspect& aspect, const Viewport& viewport, const Hierarchy& hierarchy);

// Fits of all lights that cast shadows. One that the map has as it stands now gets its layer of the map, and, where
// something moves, two standard maps beside it: of what moves, for all surfaces, and of what is in the map, for those
// that are not (ShadowCasters). Every other light gets a standard map of everything: never a shadow that is not true
// any more. Messages name the lights, those that an animation moves apart: they are not expected in a map.
ShadowFits fitWithLightMap(const Aspect& aspect, const std::vector<LightInEffect>& lights, const Hierarchy& hierarchy,
                           const Box3d& sceneBounds, std::span<const View> views, const ShadowFitRequest& request,
                           const LightMapUse& use);

}  // namespace umbriel
