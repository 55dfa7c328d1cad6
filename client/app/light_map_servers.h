#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/app/light_map_scene.h"
#include "client/app/render_command.h"
#include "client/session/cluster.h"

namespace umbriel {

// Texels along each side of the shadow maps that light maps are baked from where nothing else is said.
inline constexpr std::uint32_t kBakedMapSize = 2048;

struct DrawnLightMap {
    LightMapFile file;
    double serverSeconds = 0.0;  // of processors
};

// As bakeLightMapOf(), drawn (LightMapDrawing) on servers that are reached or started for it; the stage has one
// viewport and a camera with one eye. The scene is of no other use afterwards.
Result<DrawnLightMap> drawLightMapOf(ClusterOptions cluster, Aspect& scene, const Stage& stage,
                                     const LightMapOptions& options, const std::vector<std::string>& moving = {});

// Bakes a light map of the scene as it stands now, as `umbriel bake --light-map` does, and gives it to all viewports.
// from: a mode of parseBakedMode(), drawn on a server of its own; none: rays.
// Bad input as of bakeLightMapOf() and attachLightMap().
Result<Ref<LightMap>> addLightMap(LoadedStage& loaded, std::uint32_t size, std::optional<ShadowMode> from,
                                  const std::filesystem::path& serverProgram);

}  // namespace umbriel
