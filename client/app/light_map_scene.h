#pragma once

#include <string>
#include <vector>

#include "client/app/light_map_drawing.h"
#include "client/app/render_command.h"
#include "client/bake/light_map_file.h"
#include "common/base/result.h"
#include "common/scene/light_map.h"
#include "common/scene/windows.h"

namespace umbriel {

// What stays where it is, baked; the lights that stay and cast shadows, from all fixed surfaces below root. What an
// animation moves, what is deformed or has levels of detail, and what lies below a node with one of the names in
// `moving` neither casts nor gets a place.
// drawing: of this very scene, finds the factors in place of rays, and changes the scene for that; null: rays.
// Bad input: no such light or no such surface, no node with such a name, more than 64 lights, an atlas that is too
// small.
Result<LightMapFile> bakeLightMapOf(const Aspect& scene, Ref<Node> root, const LightMapOptions& options,
                                    const std::vector<std::string>& moving = {}, LightMapDrawing* drawing = nullptr);

// Puts a light map into the scene, and gives it to all viewports of the window. Its surfaces are found by their states.
// Bad input when none of them is in the scene: it was baked of another one.
Result<Ref<LightMap>> attachLightMap(Aspect& scene, Ref<Window> window, const LightMapFile& file);

// Whether one is named or lies beside the scene.
bool hasLightMap(const SceneArguments& arguments);

// --light-map, or the file beside the scene when a viewport's mode (or the front of a frame budget) asks for one. Where
// it is umbriel trade's choice that asks and the file beside the scene cannot be used, the choice is replaced by the
// next one, with a warning.
Result<void> applyLightMap(const SceneArguments& arguments, Aspect& scene, Ref<Window> window);

}  // namespace umbriel
