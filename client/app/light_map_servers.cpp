#include "client/app/light_map_servers.h"

#include <algorithm>

#include "common/scene/cameras.h"
#include "common/wall/grid.h"

namespace umbriel {
namespace {

// With one viewport that looks with one eye, and without the light maps that there are, so that they are not shipped.
void simplify(Aspect& scene, const Stage& stage, ShadowMode from) {
    for (const ContainerId id : scene.ids())
        if (scene.findAs<LightMap>(id)) scene.destroy(id);
    scene.edit(stage.window).assign<&Window::viewports>(std::vector<Ref<Viewport>>{stage.viewport});
    if (const auto* pair = scene.findAs<StereoCameraDecorator>(scene.get(stage.viewport).camera.get().id)) {
        const Ref<Container> camera = pair->camera;
        scene.edit(stage.viewport).set<&Viewport::camera>(camera);
    }
    scene.edit(stage.viewport).set<&Viewport::shadowMode>(from).set<&Viewport::mapSize>(kBakedMapSize);
}

}  // namespace

Result<DrawnLightMap> drawLightMapOf(ClusterOptions cluster, Aspect& scene, const Stage& stage,
                                     const LightMapOptions& options, const std::vector<std::string>& moving) {
    const std::int32_t wall = LightMapDrawing::wallSide(options.size, options.samples);
    const auto servers = static_cast<std::int64_t>(
        cluster.servers.empty() ? static_cast<std::size_t>(cluster.local) : cluster.servers.size());
    const auto tiles = gridTiles({wall, wall}, std::min<std::int64_t>(servers, wall), 1);
    if (!tiles) return tiles.error();
    auto connected = Cluster::connect(cluster, scene.types(), *tiles);
    if (!connected) return connected.error();
    (*connected)->measureCost(true);
    DrawnLightMap drawn;
    LightMapDrawing drawing(scene, stage.window, stage.viewport,
                            [&](Aspect& changed, const WallViews& views) -> Result<std::vector<TilePixels>> {
                                auto report = (*connected)->frame(changed, views, 0.0, true);
                                if (!report) return report.error();
                                for (const ServerReport& server : report->servers)
                                    drawn.serverSeconds += server.cpuMilliseconds * 1e-3;
                                return std::move(report->tiles);
                            });
    auto file = bakeLightMapOf(scene, stage.root, options, moving, &drawing);
    if (!file) return file.error();
    drawn.file = std::move(*file);
    return drawn;
}

Result<Ref<LightMap>> addLightMap(LoadedStage& loaded, std::uint32_t size, std::optional<ShadowMode> from,
                                  const std::filesystem::path& serverProgram) {
    LightMapOptions options;
    options.size = size;
    if (!from) {
        const auto baked = bakeLightMapOf(*loaded.scene, loaded.stage.root, options);
        if (!baked) return baked.error();
        return attachLightMap(*loaded.scene, loaded.stage.window, *baked);
    }
    Aspect copy(loaded.scene->types(), loaded.ids);
    copy.merge(loaded.scene->snapshot(), *loaded.scene);
    simplify(copy, loaded.stage, *from);
    ClusterOptions cluster;
    cluster.serverProgram = serverProgram;
    cluster.serverArguments = {"--log-level", "error"};
    const auto drawn = drawLightMapOf(std::move(cluster), copy, loaded.stage, options);
    if (!drawn) return drawn.error();
    return attachLightMap(*loaded.scene, loaded.stage.window, drawn->file);
}

}  // namespace umbriel
