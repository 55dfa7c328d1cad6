#include "client/app/trade_bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/app/light_map_servers.h"
#include "client/app/output_files.h"
#include "client/session/field_text.h"
#include "client/session/views.h"
#include "common/base/log.h"
#include "common/scene/core_types.h"

namespace umbriel {
namespace {

// A turn at the clock: one frame to settle (maps, shaders), then these, or as few as are asked for.
constexpr int kTurn = 4;

double median(std::vector<double> values) {
    if (values.empty()) return 0.0;
    std::sort(values.begin(), values.end());
    const std::size_t middle = values.size() / 2;
    return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

const char* nameOf(TileMode mode) {
    return mode == TileMode::Exact ? "exact" : "offset";
}

}  // namespace

Result<std::unique_ptr<TradeBench>> TradeBench::open(const SceneArguments& arguments,
                                                     const std::filesystem::path& serverProgram,
                                                     const TradeBenchOptions& options) {
    auto bench = std::unique_ptr<TradeBench>(new TradeBench());
    auto setup = checkSceneArguments(arguments);
    if (!setup) return setup.error();
    bench->_setup = std::move(*setup);
    bench->_options = options;
    bench->_sceneName = arguments.scene;
    bench->_types = std::make_unique<TypeRegistry>();
    registerCoreTypes(*bench->_types);
    bench->_setup.cluster.serverProgram = serverProgram;
    bench->_setup.cluster.latency = 0;
    const double aspectRatio = static_cast<double>(bench->_setup.wall.width) / bench->_setup.wall.height;
    auto loaded = loadStage(arguments.scene, *bench->_types, bench->_setup.stage, aspectRatio);
    if (!loaded) return loaded.error();
    bench->_loaded = std::move(*loaded);
    bench->_settings.emplace(bench->scene(), bench->stage().window);
    auto cluster = Cluster::connect(bench->_setup.cluster, *bench->_types, bench->_setup.tiles);
    if (!cluster) return cluster.error();
    bench->_cluster = std::move(*cluster);
    bench->_machine = bench->_cluster->serverDescriptions();
    bench->_cluster->measureCost(true);
    return bench;
}

Result<void> TradeBench::useCamera(const std::string& name) {
    const LoadedScene& loaded = scene().get(_loaded->loaded);
    for (const Ref<Container>& camera : loaded.cameras.toVector()) {
        const Container* container = scene().find(camera.id);
        if (!container || container->name.get() != name) continue;
        for (const Ref<Viewport>& viewport : scene().get(stage().window).viewports.toVector()) {
            const ContainerId now = scene().get(viewport).camera.get().id;
            if (scene().findAs<StereoCameraDecorator>(now))
                scene().edit(Ref<StereoCameraDecorator>(now)).set<&StereoCameraDecorator::camera>(camera);
            else
                scene().edit(viewport).set<&Viewport::camera>(camera);
        }
        return {};
    }
    return badInput(fmt::format("the scene has no camera '{}'", name));
}

void TradeBench::judge(const std::string& node, bool bothSides) {
    _options.judgeNode = node;
    _options.bothSides = bothSides;
}

Result<TradeBench::Drawn> TradeBench::draw(std::uint32_t layers, bool wantPixels, FrameReport* report) {
    auto resolved = resolveViews(scene(), stage().window, _setup.wall, &_bounds);
    if (!resolved) return resolved.error();
    Drawn drawn;
    drawn.views = std::move(resolved->views);
    drawn.views.tiles = _setup.tileMode;
    drawn.views.samples = 1;
    drawn.views.layers = layers;
    // Nothing is judged by its colour; what colours cost is that of a picture to look at.
    drawn.views.colourPrecision = _setup.colourPrecision.value_or(ColourPrecision::Half);
    auto frame = _cluster->frame(scene(), drawn.views, 0.0, wantPixels);
    if (!frame) return frame.error();
    if (wantPixels) {
        // By number: two lights may have the same name.
        for (TilePixels& tile : frame->tiles) {
            int light = 0;
            for (TileLayer& layer : tile.layers)
                if (layer.layer == Layer::LightFactors) layer.name = fmt::format("factor{}", light++);
        }
        for (const Eye eye : _setup.eyes) drawn.pictures.push_back(assembleWall(_setup.wall, frame->tiles, eye));
    }
    if (report) *report = std::move(*frame);
    return drawn;
}

Result<void> TradeBench::apply(const TradeSetting& setting) {
    const auto technique = parseTechnique(setting.technique);
    if (!technique) return technique.error();
    if (technique->mode == ShadowMode::LightMap) {
        const std::pair key(technique->bakedFrom, setting.mapSize);
        auto known = _lightMaps.find(key);
        if (known == _lightMaps.end()) {
            if (setting.mapSize == 0) return badInput("light maps have no size 0: --map-sizes says how large they are");
            const auto added =
                addLightMap(*_loaded, setting.mapSize, technique->bakedFrom, _setup.cluster.serverProgram);
            if (!added) return added.error();
            known = _lightMaps.emplace(key, *added).first;
        }
        for (const Ref<Viewport>& viewport : scene().get(stage().window).viewports.toVector())
            scene().edit(viewport).set<&Viewport::lightMap>(known->second);
    }
    return _settings->apply(setting);
}

Result<void> TradeBench::buildScene() {
    const Viewport& viewport = scene().get(stage().viewport);
    ShadowScene::Options options;
    options.excludeNodes = viewport.excludeNodes.toVector();
    options.lightNodes = viewport.lightNodes.toVector();
    auto resolved = resolveViews(scene(), stage().window, _setup.wall, &_bounds);
    if (!resolved) return resolved.error();
    if (!resolved->views.views.empty()) options.eyeWorld = resolved->views.views.front().eyeWorld;
    auto built = ShadowScene::create(scene(), viewport.root, options);
    if (!built) return built.error();
    _shadowScene = std::move(*built);
    if (!_options.lightSize) return {};
    for (TruthLight& light : _shadowScene->lights()) {
        light.radius = *_options.lightSize;
        // The renderer's soft techniques are to know it, too.
        const ContainerId core = scene().get(light.node).core.get().id;
        for (const std::string_view field : {"radius", "angularRadius"})
            if (hasField(scene(), core, field))
                if (const auto set = setField(scene(), core, field, fmt::format("{}", *_options.lightSize)); !set)
                    return set.error();
    }
    return {};
}

Result<std::vector<TradeBench::Look>> TradeBench::lookNow() {
    const auto drawn = draw(kSurfaceLayers, true);
    if (!drawn) return drawn.error();
    std::vector<Look> looks;
    for (std::size_t i = 0; i < _setup.eyes.size(); ++i) {
        Look look;
        look.eye = _setup.eyes[i];
        const auto view = std::find_if(drawn->views.views.begin(), drawn->views.views.end(),
                                       [&](const View& v) { return v.eye == look.eye; });
        if (view == drawn->views.views.end()) return failure("an eye has no view");
        look.view = *view;
        auto points = surfacePoints(drawn->pictures[i], look.view);
        if (!points) return points.error();
        look.points = std::move(*points);
        const auto outline = silhouettes(look.points);
        JudgedOptions judging;
        judging.bothSides = _options.bothSides;
        std::vector<std::uint8_t> only;
        if (!_options.judgeNode.empty()) {
            const auto nodes = _shadowScene->nodesNamed(_options.judgeNode);
            if (nodes.empty()) return badInput(fmt::format("the scene has no node '{}' to judge", _options.judgeNode));
            only = pixelsOf(look.points, nodes);
            judging.only = &only;
        }
        for (std::size_t light = 0; light < _shadowScene->lights().size(); ++light) {
            look.truth.push_back(shadowTruth(*_shadowScene, look.points, light, _options.truth));
            look.judged.push_back(judgedPixels(*_shadowScene, look.points, light, outline, judging));
            if (!_shadowScene->lights()[light].castsShadow)
                std::fill(look.judged.back().begin(), look.judged.back().end(), 0);
        }
        looks.push_back(std::move(look));
    }
    return looks;
}

// A slow move to the right, with a camera of our own where the other one stands.
Result<void> TradeBench::movePath(int frame) {
    const Look& first = _looks.front();
    double distance = 0.0;
    std::size_t covered = 0;
    for (const float depth : first.points.depths)
        if (depth > 0.0f) {
            distance += static_cast<double>(depth);
            ++covered;
        }
    distance = covered > 0 ? distance / static_cast<double>(covered) : 1.0;
    const glm::dmat3 worldFromView = glm::transpose(first.view.viewFromWorld);
    scene()
        .edit(stage().cameraPose)
        .set<&Transform::linear>(glm::mat3(worldFromView))
        .set<&Transform::translation>(first.view.eyeWorld +
                                      worldFromView[0] * (_options.flickerStep * distance * frame));
    scene().edit(stage().ownCamera).set<&PerspectiveCamera::fovY>(2.0 * std::atan(1.0 / first.view.clipFromView[1][1]));
    for (const Ref<Viewport>& viewport : scene().get(stage().window).viewports.toVector())
        scene().edit(viewport).set<&Viewport::camera>(Ref<Container>(stage().ownCamera.id));
    return {};
}

Result<void> TradeBench::look() {
    for (const auto& [key, map] : _lightMaps) scene().destroy(map);
    _lightMaps.clear();
    if (const auto set = _settings->apply({"none", 512, {}, {}, {}}); !set) return set.error();
    if (const auto built = buildScene(); !built) return built.error();
    auto looks = lookNow();
    if (!looks) return looks.error();
    _looks = std::move(*looks);
    if (_looks.size() == 2) {
        const auto around = surfacesAround(_looks[0].points, _looks[1].points, _looks[1].view);
        double sum = 0.0;
        for (std::size_t light = 0; light < _looks[0].truth.size(); ++light)
            sum += surfaceRivalry(_looks[0].truth[light], _looks[1].truth[light], around, _looks[0].judged[light],
                                  _looks[1].judged[light])
                       .share();
        _eyesTruth = sum / static_cast<double>(std::max<std::size_t>(1, _looks[0].truth.size()));
    }
    _path.clear();
    _pathTruth.clear();
    if (_options.flickerFrames < 2 || _looks.size() != 1) return {};
    const Ref<Container> camera = scene().get(stage().viewport).camera;
    for (int frame = 0; frame < _options.flickerFrames; ++frame) {
        if (const auto moved = movePath(frame); !moved) return moved.error();
        auto step = lookNow();
        if (!step) return step.error();
        _path.push_back(std::move(*step));
    }
    scene().edit(stage().viewport).set<&Viewport::camera>(camera);
    return {};
}

Result<std::vector<std::vector<std::vector<float>>>> TradeBench::factorsNow() {
    const auto drawn =
        draw(static_cast<std::uint32_t>(Layer::Colour) | static_cast<std::uint32_t>(Layer::LightFactors), true);
    if (!drawn) return drawn.error();
    std::vector<std::vector<std::vector<float>>> factors;
    for (const LayeredImage& picture : drawn->pictures) {
        factors.emplace_back();
        for (std::size_t light = 0; light < _shadowScene->lights().size(); ++light) {
            const FloatImage* layer = picture.floatLayer(fmt::format("factor{}", light));
            if (!layer) return failure(fmt::format("the servers sent no factors of light {}", light));
            factors.back().push_back(layer->samples());
        }
    }
    return factors;
}

Result<void> TradeBench::time(std::vector<TradeRow>& rows, int frames) {
    struct Samples {
        std::vector<double> wall, cpu, gpu, ratios;
    };
    std::vector<Samples> samples(rows.size());
    const std::uint32_t colour = static_cast<std::uint32_t>(Layer::Colour);
    // Every frame draws its maps, as while things move, unless the setting says otherwise.
    const auto applyForCost = [&](const TradeRow& row) -> Result<void> {
        for (const Ref<Viewport>& viewport : scene().get(stage().window).viewports.toVector())
            scene().edit(viewport).set<&Viewport::reuseMaps>(false);
        return apply(row.setting);
    };
    // One untimed frame each, so that no shader is compiled while the clock runs.
    for (TradeRow& row : rows) {
        if (const auto set = applyForCost(row); !set) return set.error();
        if (const auto drawn = draw(colour, false); !drawn) return drawn.error();
    }
    const int length = std::min(kTurn, std::max(1, frames));
    const int turns = std::max(1, (frames + kTurn - 1) / kTurn);
    for (int turn = 0; turn < turns; ++turn) {
        double reference = 0.0;
        for (std::size_t i = 0; i < rows.size(); ++i) {
            if (const auto set = applyForCost(rows[i]); !set) return set.error();
            std::vector<double> ofTurn;
            for (int frame = -1; frame < length; ++frame) {
                FrameReport report;
                if (const auto drawn = draw(colour, false, &report); !drawn) return drawn.error();
                if (frame < 0) continue;
                double wall = 0.0, cpu = 0.0, gpu = 0.0;
                for (const ServerReport& server : report.servers) {
                    wall = std::max(wall, server.drawMilliseconds);
                    gpu = std::max(gpu, server.gpuMilliseconds);
                    cpu += server.cpuMilliseconds;
                    rows[i].cost.mapBytes = frame == 0 && turn == 0
                                                ? server.shadowMapBytes
                                                : std::max(rows[i].cost.mapBytes, server.shadowMapBytes);
                }
                samples[i].wall.push_back(wall);
                samples[i].cpu.push_back(cpu);
                samples[i].gpu.push_back(gpu);
                ofTurn.push_back(cpu);
            }
            if (i == 0) reference = median(ofTurn);
            if (reference > 0.0) samples[i].ratios.push_back(median(ofTurn) / reference);
        }
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
        TradeCost& cost = rows[i].cost;
        cost.wallMilliseconds = median(samples[i].wall);
        cost.cpuMilliseconds = median(samples[i].cpu);
        cost.gpuMilliseconds = median(samples[i].gpu);
        cost.cpuRatio = samples[i].ratios.empty() ? 1.0 : median(samples[i].ratios);
        cost.frames = static_cast<int>(samples[i].cpu.size());
    }
    return {};
}

TradeResult TradeBench::describe() const {
    TradeResult result;
    result.scene = _sceneName;
    result.version = UMBRIEL_VERSION;
    for (const std::string& line : _machine) result.machine += (result.machine.empty() ? "" : "; ") + line;
    result.machine +=
        fmt::format("; {} servers, {} tiles, {}", _machine.size(), _setup.tiles.size(), nameOf(_setup.tileMode));
    result.width = _setup.wall.width;
    result.height = _setup.wall.height;
    std::uint64_t covered = 0, judged = 0;
    for (const Look& look : _looks) {
        for (std::size_t light = 0; light < look.judged.size(); ++light) {
            if (!_shadowScene->lights()[light].castsShadow) continue;
            for (std::size_t i = 0; i < look.points.size(); ++i) {
                covered += look.points.covered(i) ? 1 : 0;
                judged += look.judged[light][i];
            }
        }
    }
    result.judgedShare = covered > 0 ? static_cast<double>(judged) / static_cast<double>(covered) : 0.0;
    bool soft = false;
    std::size_t casting = 0;
    if (_shadowScene)
        for (const TruthLight& light : _shadowScene->lights()) {
            soft = soft || light.radius > 0.0;
            casting += light.castsShadow ? 1 : 0;
        }
    const int side = _options.truth.lightSamplesPerSide;
    result.truth = fmt::format("{} a point and light against {} triangles, {} lights",
                               soft ? fmt::format("{} rays", side * side) : std::string("one ray"),
                               _shadowScene ? _shadowScene->triangleCount() : 0, casting);
    if (!_looks.empty() && !_looks.front().truth.empty()) {
        const Look& look = _looks.front();
        result.truthFactors = factorImage(look.points, look.truth.front());
        result.judged = look.judged.front();
    }
    return result;
}

}  // namespace umbriel
