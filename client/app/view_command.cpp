#include "client/app/view_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>

#include "client/app/frame_budget.h"
#include "client/app/held_tiles.h"
#include "client/app/light_map_scene.h"
#include "client/app/orbit.h"
#include "client/app/shadow_panel.h"
#include "client/app/window.h"
#include "client/session/animation_player.h"
#include "client/session/views.h"
#include "common/base/log.h"
#include "common/scene/core_types.h"
#include "common/scene/traversal.h"
#include "common/wall/grid.h"

namespace umbriel {
namespace {

// Time of the animation: stands while stopped, else runs with the clock.
class Playback {
   public:
    explicit Playback(const Clock& clock) : _clock(clock), _last(clock.now()) {}
    double advance() {
        const TimePoint now = _clock.now();
        if (_running) _time += toSeconds(now - _last);
        _last = now;
        return _time;
    }
    void toggle() { _running = !_running; }

   private:
    const Clock& _clock;
    TimePoint _last;
    double _time = 0.0;
    bool _running = true;
};

// Puts the stage's own camera on the orbit; the first movement leaves a file's camera for it.
class CameraControl {
   public:
    CameraControl(Aspect& scene, Stage& stage, const View& first) : _scene(scene), _stage(stage) {
        GeometryBounds geometryBounds;
        const Box3d bounds = worldBounds(scene, stage.root, geometryBounds);
        const glm::dvec3 forward = -glm::dvec3(first.viewFromWorld[0].z, first.viewFromWorld[1].z, first.viewFromWorld[2].z);
        // The point looked at: where the view axis passes the middle of the scene.
        const glm::dvec3 middle = bounds.empty() ? glm::dvec3(0.0) : bounds.centre();
        const double size = bounds.empty() ? 1.0 : std::max(bounds.diagonal(), 1e-9);
        const double distance = std::max(glm::dot(middle - first.eyeWorld, forward), 0.05 * size);
        _orbit = Orbit::around(first.eyeWorld + distance * forward, first.eyeWorld);
    }

    void apply(const WindowInput& input, PixelSize window) {
        const bool moved = input.orbitX != 0 || input.orbitY != 0 || input.panX != 0 || input.panY != 0 || input.wheel != 0;
        if (!moved || window.height <= 0) return;
        const double perPixel = 1.0 / window.height;
        _orbit.turn(input.orbitX * perPixel, input.orbitY * perPixel);
        _orbit.pan(input.panX * perPixel, input.panY * perPixel);
        _orbit.approach(input.wheel);
        const glm::dvec3 eye = _orbit.eye();
        _scene.edit(_stage.cameraPose)
            .set<&Transform::linear>(glm::mat3(lookingAlong(_orbit.centre - eye, {0, 1, 0})))
            .set<&Transform::translation>(eye);
        _scene.edit(_stage.viewport).set<&Viewport::camera>(Ref<Container>(_stage.ownCamera.id));
    }

   private:
    Aspect& _scene;
    Stage& _stage;
    Orbit _orbit;
};

void follow(const WindowInput& input, ShadowPanel& panel) {
    if (input.panelToggled) panel.toggle();
    if (!panel.isOpen()) return;
    if (input.panelField != 0) panel.choose(input.panelField);
    panel.step(input.panelSteps);
    panel.type(input.typed);
    if (input.erased) panel.erase();
    if (input.entered) panel.set();
}

}  // namespace

int runView(const ViewArguments& arguments, const std::filesystem::path& serverProgram) {
    SceneArguments sceneArguments = arguments.scene;
    // One window on this machine: one embedded server unless a wall is asked for.
    if (!sceneArguments.local && sceneArguments.servers.empty() && sceneArguments.listen.empty() &&
        sceneArguments.grid == "1x1")
        sceneArguments.local = 1;
    if (!sceneArguments.stereo.empty())
        return exitCodeOf(badInput("--stereo: the window of this version shows one eye; render draws pairs"));
    auto setup = checkSceneArguments(sceneArguments);
    if (setup && setup->stage.captureEnvironment)
        return exitCodeOf(badInput("--environment capture: is for umbriel render; view takes a file"));
    if (!setup) return exitCodeOf(setup.error());
    const auto grid = parseGrid("--grid", sceneArguments.grid);
    if (!grid) return exitCodeOf(grid.error());

    auto window = DisplayWindow::open(setup->wall, "umbriel");
    if (!window) return exitCodeOf(window.error());
    TypeRegistry types;
    registerCoreTypes(types);
    auto loaded = loadStage(sceneArguments.scene, types, setup->stage,
                            static_cast<double>(setup->wall.width) / setup->wall.height);
    if (!loaded) return exitCodeOf(loaded.error());
    Aspect& scene = *(*loaded)->scene;
    Stage& stage = (*loaded)->stage;
    if (const auto stored = applyStoredShadows(sceneArguments, scene, stage.window); !stored)
        return exitCodeOf(stored.error());
    std::optional<FrameBudget> budget;
    if (sceneArguments.frameBudget) {
        auto begun = FrameBudget::begin(sceneArguments, scene, stage.window);
        if (!begun) return exitCodeOf(begun.error());
        budget.emplace(std::move(*begun));
    }
    if (const auto applied = applyLightMap(sceneArguments, scene, stage.window); !applied)
        return exitCodeOf(applied.error());
    setup->cluster.serverProgram = serverProgram;
    auto cluster = Cluster::connect(setup->cluster, types, setup->tiles);
    if (!cluster) return exitCodeOf(cluster.error());

    const SteadyClock clock;
    Playback playback(clock);
    AnimationPlayer player(scene, (*loaded)->loaded);
    std::optional<CameraControl> camera;
    ShadowPanel panel(scene, stage.window, stage.viewport);
    HeldTiles held;
    GeometryBounds bounds;  // of what stays the same from frame to frame
    std::set<std::string> warned;  // each thing once
    TimePoint titleTime = clock.now();
    std::uint64_t titleFrames = 0;
    for (std::uint64_t frames = 0; arguments.frames == 0 || frames < arguments.frames; ++frames) {
        const WindowInput input = (*window)->poll();
        if (input.closed) break;
        if (input.animationToggled) playback.toggle();
        if (const PixelSize size = (*window)->size(); size.width > 0 && size.height > 0 && size != setup->wall) {
            // A window smaller than its grid keeps its tiles until it is larger again.
            if (auto tiles = gridTiles(size, grid->columns, grid->rows)) {
                if (const auto assigned = (*cluster)->assign(*tiles); !assigned) return exitCodeOf(assigned.error());
                setup->wall = size;
                held.clear();
            }
        }
        const double time = playback.advance();
        player.advanceTo(time, scene);
        if (camera) camera->apply(input, setup->wall);
        follow(input, panel);
        panel.show();
        auto views = resolveViews(scene, stage.window, setup->wall, &bounds);
        if (!views && panel.isOpen()) {
            panel.refuse(views.error().message);
            panel.show();
            views = resolveViews(scene, stage.window, setup->wall, &bounds);
        }
        if (!views) return exitCodeOf(views.error());
        for (const std::string& warning : views->warnings)
            if (warned.insert(warning).second) log::warning(warning);
        // From the light's view no orbit can be made.
        const bool isEye = scene.get(stage.viewport).show.get() != ShadowShow::LightView;
        if (!camera && isEye && !views->views.views.empty())
            camera.emplace(scene, stage, views->views.views.front());
        views->views.tiles = setup->tileMode;
        views->views.samples = setup->samples;
        views->views.colourPrecision = setup->colourPrecision.value_or(ColourPrecision::Half);
        auto report = (*cluster)->frame(scene, views->views, time, true);
        if (!report) return exitCodeOf(report.error());
        if (budget)
            if (const auto followed = budget->follow(*report); !followed) return exitCodeOf(followed.error());
        held.take(std::move(report->tiles));
        if (report->frame > 0) (*window)->show(assembleWall(setup->wall, held.all(), Eye::Mono).rgba);

        ++titleFrames;
        if (const TimePoint now = clock.now(); now - titleTime >= std::chrono::seconds(1)) {
            (*window)->setTitle(fmt::format("umbriel - {} - {:.1f} frames/s", sceneArguments.scene,
                                            static_cast<double>(titleFrames) / toSeconds(now - titleTime)));
            titleTime = now;
            titleFrames = 0;
        }
    }
    return 0;
}

}  // namespace umbriel
