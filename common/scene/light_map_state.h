#pragma once

#include <cstdint>
#include <vector>

#include "common/scene/light_map.h"
#include "common/scene/traversal.h"

namespace umbriel {

// What light maps (light_map.h) are baked of and looked up by: states of surfaces and lights, as hashes. Two surfaces
// with one state stand at the same place and have the same shape and the same holes; so a map is as good for a scene as
// the states it was baked of are there again. Ids and names do not count.

// A visible geometry, where it stands.
struct DrawnSurface {
    Ref<Node> node;
    Ref<Geometry> geometry;
    Affine worldFromObject;
    std::uint64_t state = 0;
    // May stand elsewhere or look otherwise in the next frame: below a node that an animation moves, deformed, or one
    // of several levels of detail.
    bool moves = false;
};

// In the order of the scene graph. excluded: what is below these casts nothing, which is part of its state. State of a
// deformed geometry: 0.
std::vector<DrawnSurface> drawnSurfaces(const Aspect& aspect, Ref<Node> root, const Hierarchy& hierarchy,
                                        const std::vector<Ref<Node>>& excluded = {});

// Everything about a light that decides where its shadows fall: kind, place, direction and size, but not its colour.
std::uint64_t lightState(const Aspect& aspect, const LightInEffect& light);

// An animation moves the light.
bool moves(const Aspect& aspect, const LightInEffect& light, const Hierarchy& hierarchy);

// How a scene is now, against what a map was baked of.
struct LightMapMatch {
    std::size_t missing = 0;  // surfaces of the map that do not stand where they did
    bool hasOthers = false;   // something is drawn that is not in the map: what moves
};
LightMapMatch match(const LightMap& map, const std::vector<DrawnSurface>& drawn);

// The map's layer of a light with this state; -1: the map does not have it.
std::int32_t layerOf(const LightMap& map, std::uint64_t lightState);

}  // namespace umbriel
