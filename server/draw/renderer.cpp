#include "server/draw/renderer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <deque>
#include <set>

#include "server/draw/tile_painter.h"
#include "server/draw/tile_pieces.h"
#include "server/gl/context.h"
#include "server/gl/query.h"
#include "server/gl/workarounds.h"

namespace umbriel {
namespace {

BackgroundKind backgroundOf(const Aspect& scene, const Viewport& viewport) {
    const Container* background = scene.find(viewport.background.get().id);
    if (!background) return BackgroundKind::None;
    if (isA<ColourBackground>(*background)) return BackgroundKind::Colour;
    if (isA<GradientBackground>(*background)) return BackgroundKind::Gradient;
    if (isA<ImageBackground>(*background)) return BackgroundKind::Image;
    if (isA<EnvironmentBackground>(*background)) return BackgroundKind::Environment;
    return BackgroundKind::None;
}

ViewDemand demandOf(const Aspect& scene, const ViewScene& view) {
    ViewDemand demand;
    demand.eye = view.view->eye;
    demand.region = view.view->region;
    demand.unwrapped = view.view->unwrapped;
    if (!view.viewport) return demand;
    demand.name = view.viewport->name.get();
    demand.background = backgroundOf(scene, *view.viewport);
    demand.foregrounds = static_cast<std::uint32_t>(view.viewport->foregrounds.size());
    for (const SurfaceItem& item : view.items) ++demand.surfaces[item.features];
    demand.lights = static_cast<std::uint32_t>(view.lights.lights.size());
    for (const Deformer::Size& size : view.deformed) {
        ++demand.deformed.geometries;
        demand.deformed.vertices += size.vertices;
        demand.deformed.joints += size.joints;
        demand.deformed.morphTargets += size.morphTargets;
    }
    for (std::size_t i = 0; i < view.lights.fits.size(); ++i) {
        ViewDemand::Shadow shadow;
        shadow.light = view.lights.names[view.lights.shadowLights[i]];
        const ShadowFit& fit = *view.lights.fits[i];
        shadow.demand = shadowModule(fit.mode)->demand(fit);
        shadow.among = fit.casters;
        for (const SurfaceItem& item : view.items) {
            if (!item.castsShadow || !item.isAmong(fit.casters)) continue;
            ++shadow.casters;
            if (item.casterFeatures != 0) ++shadow.maskedCasters;
        }
        demand.copiedMaps = demand.copiedMaps || shadow.demand.boundsBlock > 0;
        demand.shadows.push_back(shadow);
    }
    demand.copiedMaps = demand.copiedMaps ||
                        std::any_of(view.lights.runs.begin(), view.lights.runs.end(), [](const LightList::Run& run) {
                            return has(run.features, Feature::ShadowCopy);
                        });
    if (view.lightMap) demand.lightMap = {view.lightMap->pageSize(), view.lightMap->layers(), view.lightMap->bytes()};
    demand.screen = view.screen;
    demand.show = view.viewport->show;
    if (const ShownLight shown = shownLightOf(view); shown.parts > 0) {
        demand.shownLight = view.lights.names[view.lights.shadowLights[shown.first]];
        demand.shownParts = shown.parts;
        demand.shownTexels = view.lights.fits[shown.first]->mapSize;
    }
    for (const std::uint32_t light : view.lights.darkLights) demand.darkLights.push_back(view.lights.names[light]);
    return demand;
}

// Of all threads of this process, those of a software renderer with them.
double processorMilliseconds() {
    timespec used{};
    if (clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used) != 0) return 0.0;
    return static_cast<double>(used.tv_sec) * 1e3 + static_cast<double>(used.tv_nsec) * 1e-6;
}

// Empty where the driver's timer queries cannot be believed.
gl::Query frameTimer(const gl::Workarounds& workarounds) {
    if (workarounds.isActive(gl::Workaround::LlvmpipeTimerQueriesLie)) return {};
    return gl::Query(GL_TIME_ELAPSED);
}

class SceneRenderer final : public Renderer {
 public:
    SceneRenderer(gl::HeadlessContext& context, const Options& options, const gl::Workarounds& workarounds)
        : _limits(context.info().limits),
          _scene(options.textureBudgetBytes, _limits.maxTextureSize, options.largestLightMapPage,
                 workarounds.isActive(gl::Workaround::LlvmpipeGathersConstants)),
          _painter(_scene, _shaders, _targets, {_limits.maxViewportWidth, _limits.maxViewportHeight}),
          _timer(frameTimer(workarounds)) {}

    void sceneChanged(const ChangeList& changes, const Aspect& scene) override { _scene.changed(changes, scene); }

    Result<DrawStatistics> draw(const Aspect& scene, const WallViews& views, std::span<const TileAssignment> tiles,
                                double time) override {
        static_cast<void>(time);  // nothing drawn here moves by itself
        const auto start = std::chrono::steady_clock::now();
        const double cpuStart = processorMilliseconds();
        if (auto checked = check(views, tiles); !checked) return checked.error();
        _tiles.assign(tiles.begin(), tiles.end());
        _shaders.setSamples(views.samples);
        _shaders.setHalfColours(views.colourPrecision == ColourPrecision::Half);
        _pieces = piecesOf(_tiles, largestPiece());
        if (auto updated = _scene.update(scene); !updated) return updated.error();
        _lightNodes.clear();
        _lightNames.clear();
        std::vector<ViewPainting> paintings;
        std::vector<ViewDemand> demands;
        for (std::size_t i = 0; i < views.views.size(); ++i) {
            auto prepared = _scene.prepare(scene, views.views[i], views.layers, _shaders);
            if (!prepared) return prepared.error();
            ViewPainting painting;
            painting.scene = std::move(*prepared);
            dropUnseenShadows(painting.scene, views.layers);
            numberLights(painting.scene.lights);
            if (auto set = _painter.setLights(i, painting.scene.lights); !set) return set.error();
            demands.push_back(demandOf(scene, painting.scene));
            paintings.push_back(std::move(painting));
        }
        const auto factorLights = static_cast<std::uint32_t>(_lightNodes.size());
        auto plan = planFrame(views, demands, _pieces, factorLights,
                              std::min({_limits.maxTextureSize, _limits.maxViewportWidth, _limits.maxViewportHeight}));
        if (!plan) return plan.error();
        if (auto uploaded = _scene.materials().upload(); !uploaded) return uploaded.error();
        if (auto reserved = reserveShadowMaps(demands, paintings); !reserved) return reserved.error();
        if (auto reserved = reserveDarkness(views, demands, plan->apron); !reserved) return reserved.error();
        if (auto reserved = _targets.reserve(views, _pieces, factorLights, plan->apron); !reserved)
            return reserved.error();

        if (_timer) _timer.begin();
        _painter.beginFrame();
        for (std::size_t i = 0; i < _pieces.size(); ++i)
            if (auto painted = _painter.paint(scene, views, *plan, paintings, _pieces[i], i); !painted)
                return painted.error();
        if (_timer) _timer.end();
        glFinish();
        if (auto checked = gl::checkError("drawing a frame"); !checked) return checked.error();
        _plan = std::move(*plan);
        DrawStatistics statistics;
        statistics.triangles = _painter.counts().triangles;
        statistics.shadowTriangles = _painter.counts().shadowTriangles;
        if (_timer) statistics.gpuMilliseconds = static_cast<double>(_timer.result()) * 1e-6;
        for (const KeptShadowMaps& kept : _shadowMaps) statistics.shadowMapBytes += kept.maps.bytes();
        std::set<const GpuLightMap*> counted;
        for (const ViewPainting& painting : paintings)
            if (painting.scene.lightMap && counted.insert(painting.scene.lightMap).second)
                statistics.shadowMapBytes += painting.scene.lightMap->bytes();
        statistics.cpuMilliseconds = processorMilliseconds() - cpuStart;
        statistics.drawMilliseconds =
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
        return statistics;
    }

    Result<std::vector<TilePixels>> readTiles() override {
        auto pieces = _targets.read(_lightNames);
        if (!pieces || _pieces.size() == _tiles.size()) return pieces;
        return joinPieces(std::move(*pieces), _tiles);
    }

    std::string explain() const override { return _plan.explain(); }

 private:
    static Result<void> check(const WallViews& views, std::span<const TileAssignment> tiles) {
        if (views.samples != 1 && views.samples != 4)
            return badInput("--samples is 1 or 4, not " + std::to_string(views.samples));
        for (const TileAssignment& tile : tiles) {
            const PixelRect& pixels = tile.pixels;
            if (pixels.empty() || pixels.x < 0 || pixels.y < 0 || pixels.x + pixels.width > views.wall.width ||
                pixels.y + pixels.height > views.wall.height)
                return badInput("tile " + std::to_string(tile.tile) + " is empty or lies outside of the wall");
        }
        return {};
    }

    // Whole blocks of offset mode, so that no block is drawn twice.
    std::int32_t largestPiece() const {
        const int blocks = _limits.maxTextureSize / kBlockPixels;
        return blocks > 0 ? blocks * kBlockPixels : _limits.maxTextureSize;
    }

    // A map that no surface asks for is not drawn.
    static void dropUnseenShadows(ViewScene& view, std::uint32_t layers) {
        const bool wantsFactors = (layers & static_cast<std::uint32_t>(Layer::LightFactors)) != 0;
        const bool used = std::any_of(view.items.begin(), view.items.end(), [&](const SurfaceItem& item) {
            return has(item.features, Feature::Shadows) || (wantsFactors && has(item.layerFeatures, Feature::Shadows));
        });
        if (used) return;
        view.lights.fits.clear();
        view.lights.shadows.clear();
        view.lights.shadowLights.clear();
        view.lights.darkLights.clear();
        view.lightMap = nullptr;
        view.screen.factors = false;
        view.screen.radius = 0.0f;
        view.screen.edges = view.screen.edges && view.viewport && view.viewport->show.get() == ShadowShow::EdgeMap;
        view.screen.surfaces = view.screen.edges;
        for (gpu::GpuLight& light : view.lights.lights) light.shadowIndex = -1;
    }

    // Lights are numbered over all views: the layers of light factors belong to the wall.
    void numberLights(LightList& lights) {
        for (std::size_t i = 0; i < lights.lights.size(); ++i) {
            auto known = std::find(_lightNodes.begin(), _lightNodes.end(), lights.nodes[i]);
            lights.lights[i].index = static_cast<std::uint32_t>(known - _lightNodes.begin());
            if (known != _lightNodes.end()) continue;
            _lightNodes.push_back(lights.nodes[i]);
            _lightNames.push_back(lights.names[i]);
        }
    }

    Result<void> reserveShadowMaps(const std::vector<ViewDemand>& demands, std::vector<ViewPainting>& paintings) {
        _shadowMaps.resize(demands.size());
        for (std::size_t i = 0; i < demands.size(); ++i) {
            std::uint32_t mapSize = 0;
            std::uint32_t block = 0;
            for (const ViewDemand::Shadow& shadow : demands[i].shadows) {
                mapSize = std::max(mapSize, shadow.demand.mapTexels);
                block = std::max(block, shadow.demand.boundsBlock);
            }
            if (mapSize == 0) {
                _shadowMaps[i] = KeptShadowMaps();
                continue;
            }
            const auto layers = static_cast<std::uint32_t>(
                std::count_if(demands[i].shadows.begin(), demands[i].shadows.end(),
                              [](const ViewDemand::Shadow& shadow) { return shadow.demand.mapTexels > 0; }));
            auto reserved = _shadowMaps[i].maps.reserve(mapSize, layers, block, demands[i].copiedMaps);
            if (!reserved) return reserved.error();
            if (*reserved) _shadowMaps[i].drawn.clear();
            _shadowMaps[i].drawn.resize(std::max<std::size_t>(_shadowMaps[i].drawn.size(), layers));
            paintings[i].shadowMaps = &_shadowMaps[i];
        }
        return {};
    }

    // Images of darkness, when some view asks for them.
    Result<void> reserveDarkness(const WallViews& views, const std::vector<ViewDemand>& demands, std::int32_t apron) {
        DarknessImages::Needs needs;
        for (const ViewDemand& demand : demands) {
            bool inView = demand.screen.factors;
            for (const ViewDemand::Shadow& shadow : demand.shadows) {
                inView = inView || shadow.demand.inView;
                needs.positions = needs.positions || shadow.demand.positions;
            }
            const auto layers = inView ? static_cast<std::uint32_t>(demand.darkLights.size()) : 0u;
            needs.layers = std::max(needs.layers, layers);
            needs.edges = needs.edges || demand.screen.edges;
            needs.normals = needs.normals || demand.screen.surfaces;
            needs.positions = needs.positions || demand.screen.surfaces;
            needs.filter = needs.filter || (demand.screen.radius > 0.0f && layers > 0);
        }
        needs.size = workSizeOf(views, apron);
        needs.samples = views.samples;
        return _painter.reserveDarkness(needs);
    }

    gl::ContextLimits _limits;
    GpuScene _scene;
    ShaderLibrary _shaders;
    TileTargets _targets;
    TilePainter _painter;
    std::deque<KeptShadowMaps> _shadowMaps;  // by view
    std::vector<ContainerId> _lightNodes;
    std::vector<std::string> _lightNames;
    std::vector<TileAssignment> _tiles;
    std::vector<TileAssignment> _pieces;  // of the tiles, none larger than a texture
    FramePlan _plan;
    gl::Query _timer;
};

}  // namespace

Result<std::unique_ptr<Renderer>> Renderer::create(gl::HeadlessContext& context, const Options& options) {
    if (!context.isCurrent()) return failure("the renderer's OpenGL context is not current on this thread");
    const auto workarounds = gl::Workarounds::detect(context.info(), options.disabledWorkarounds);
    if (!workarounds) return workarounds.error();
    return std::unique_ptr<Renderer>(std::make_unique<SceneRenderer>(context, options, *workarounds));
}

}  // namespace umbriel
