#include "client/app/render_command.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <ostream>
#include <set>

#include "client/app/environment_capture.h"
#include "client/app/exit_code.h"
#include "client/app/frame_budget.h"
#include "client/app/held_tiles.h"
#include "client/app/light_map_scene.h"
#include "client/app/progress.h"
#include "client/app/trade_setting.h"
#include "client/import/load_scene.h"
#include "client/import/procedural.h"
#include "client/session/animation_player.h"
#include "client/session/views.h"
#include "client/trade/trade_choice.h"
#include "common/base/hash.h"
#include "common/base/log.h"
#include "common/scene/core_types.h"
#include "common/wall/grid.h"

namespace umbriel {
namespace {

// One file holds at most this many pixels: 4 GiB of RGBA.
constexpr std::int64_t kMaxFilePixels = std::int64_t{1} << 28;

Result<CameraArguments> checkCamera(const SceneArguments& arguments) {
    CameraArguments camera;
    camera.name = arguments.camera;
    const bool placed = !arguments.eye.empty() || !arguments.target.empty() || !arguments.up.empty();
    if (!camera.name.empty() && (placed || arguments.fov))
        return badInput(
            "--camera names a camera of the file; --eye, --target, --up and --fov describe another: give one or the "
            "other");
    const auto vector = [](std::string_view name, const std::string& text,
                           std::optional<glm::dvec3>& into) -> Result<void> {
        if (text.empty()) return {};
        const auto value = parseVector(name, text);
        if (!value) return value.error();
        into = *value;
        return {};
    };
    if (const auto eye = vector("--eye", arguments.eye, camera.eye); !eye) return eye.error();
    if (const auto target = vector("--target", arguments.target, camera.target); !target) return target.error();
    if (const auto up = vector("--up", arguments.up, camera.up); !up) return up.error();
    if (camera.eye && camera.target && *camera.eye == *camera.target)
        return badInput("--eye and --target are the same point; there is no direction to look in");
    if (camera.up && *camera.up == glm::dvec3(0.0)) return badInput("--up '0,0,0' points nowhere");
    if (arguments.fov) {
        if (!(*arguments.fov >= 1e-3 && *arguments.fov <= 179.0))
            return badInput(fmt::format("--fov {}: expected 0.001 to 179 degrees (vertical)", *arguments.fov));
        camera.fovDegrees = *arguments.fov;
    }
    return camera;
}

// Which eyes are drawn: two servers share a tile's place on the wall, one for each eye.
Result<void> checkStereo(const SceneArguments& arguments, WallSetup& setup) {
    if (!arguments.wallSize.empty()) {
        const auto size = parseWallSize(arguments.wallSize);
        if (!size) return size.error();
        setup.stage.wallSize = *size;
    }
    if (arguments.stereo.empty()) {
        if (arguments.eyeSeparation)
            return badInput(
                "--eye-separation: one eye in the middle is drawn; give --stereo left, right or pair with it");
        return {};
    }
    if (arguments.stereo != "left" && arguments.stereo != "right" && arguments.stereo != "pair")
        return badInput(fmt::format("--stereo '{}': expected left, right or pair", arguments.stereo));
    const double separation = arguments.eyeSeparation.value_or(StereoArguments().separation);
    if (!(separation >= 0.0 && separation <= 1e3))
        return badInput(fmt::format("--eye-separation {}: expected 0 to 1000 metres", separation));
    setup.stage.stereo = StereoArguments{separation};
    setup.eyes.clear();
    if (arguments.stereo != "right") setup.eyes.push_back(Eye::Left);
    if (arguments.stereo != "left") setup.eyes.push_back(Eye::Right);
    std::vector<TileAssignment> tiles;
    for (const TileAssignment& tile : setup.tiles)
        for (const Eye eye : setup.eyes) {
            tiles.push_back({static_cast<std::uint32_t>(tiles.size()), tile.pixels, eye});
        }
    setup.tiles = std::move(tiles);
    return {};
}

Result<void> checkIllumination(const SceneArguments& arguments, StageOptions& stage) {
    if (!arguments.model.empty()) {
        const auto model = parseReflectionModel(arguments.model);
        if (!model) return model.error();
        stage.model = *model;
    }
    if (!arguments.shading.empty()) {
        const auto shading = parseShading(arguments.shading);
        if (!shading) return shading.error();
        stage.shading = *shading;
    }
    if (!arguments.fog.empty()) {
        const auto fog = parseFog(arguments.fog);
        if (!fog) return fog.error();
        stage.fog = *fog;
    }
    return {};
}

// Servers beside embedded ones: those that are dialled, those that dial.
Result<void> checkServers(const SceneArguments& arguments, ClusterOptions& cluster) {
    const bool listens = !arguments.listen.empty();
    if (arguments.local && (listens || !arguments.servers.empty()))
        return badInput("--servers and --listen exclude --local: servers that run, or embedded ones");
    if (listens) {
        const auto address = parseListen(arguments.listen);
        if (!address) return address.error();
        cluster.listenHost = address->host;
        cluster.listenPort = address->port;
    }
    if (!arguments.servers.empty()) {
        auto servers = parseServers(arguments.servers, listens);
        if (!servers) return servers.error();
        cluster.servers = std::move(*servers);
    }
    const bool named = std::any_of(cluster.servers.begin(), cluster.servers.end(),
                                   [](const ServerAddress& server) { return server.host.empty(); });
    if (arguments.serversExpected) {
        if (!listens) return badInput("--servers-expected: it says how many servers dial in, --listen says where");
        if (*arguments.serversExpected < 1 || *arguments.serversExpected > 256)
            return badInput(fmt::format("--servers-expected {}: expected 1 to 256", *arguments.serversExpected));
        cluster.servers.resize(cluster.servers.size() + static_cast<std::size_t>(*arguments.serversExpected));
    } else if (listens && !named) {
        return badInput("--listen: say who dials in: their names with --servers NAME,..., or --servers-expected N");
    }
    // Servers that dial are started by hand, or by a batch system in its own time.
    const double timeout = arguments.connectTimeout.value_or(listens ? 60.0 : 5.0);
    if (!(timeout > 0.0 && timeout <= 1e6))
        return badInput(fmt::format("--connect-timeout {}: expected more than 0 and at most 1000000 seconds", timeout));
    cluster.connectTimeout = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(timeout));
    if (arguments.startIncomplete && cluster.policy == FailurePolicy::Wait)
        return badInput("--start-incomplete: under --policy wait every server is waited for; take strict or degrade");
    cluster.startIncomplete = arguments.startIncomplete;
    return {};
}

// Half floats where nothing but 8 bits of them is seen, which a far exposure would not leave true: their steps show
// from 12 EV on, and they end at 65504, which 16 EV the other way bring down to white.
ColourPrecision precisionFor(const RenderArguments& arguments, const OutputFiles& files) {
    constexpr double kMaxExposure = 8.0;
    const bool isShown =
        files.allShowBytes() && arguments.layers.empty() && std::abs(arguments.exposure) <= kMaxExposure;
    return isShown ? ColourPrecision::Half : ColourPrecision::Float;
}

nlohmann::json toJson(const FrameReport& report) {
    nlohmann::json servers = nlohmann::json::array();
    for (const ServerReport& server : report.servers)
        servers.push_back({{"name", server.name},
                           {"bytes", server.bytes},
                           {"view_bytes", server.viewBytes},
                           {"draw_ms", server.drawMilliseconds},
                           {"cpu_ms", server.cpuMilliseconds},
                           {"wait_ms", server.waitMilliseconds},
                           {"triangles", server.triangles},
                           {"shadow_triangles", server.shadowTriangles},
                           {"digest", toHex(server.digest)}});
    return {{"frame", report.frame},     {"milliseconds", report.milliseconds},
            {"entries", report.entries}, {"change_bytes", report.changeBytes},
            {"servers", servers},        {"late", report.late},
            {"lost", report.lost},       {"rejoined", report.rejoined}};
}

nlohmann::json toJson(const protocol::SwapSkew::Summary& skew) {
    const auto microseconds = [](Duration duration) { return static_cast<double>(duration.count()) / 1000.0; };
    return {{"frames", skew.frames},
            {"median_us", microseconds(skew.median)},
            {"p99_us", microseconds(skew.p99)},
            {"max_us", microseconds(skew.most)},
            {"error_us", microseconds(skew.bound)}};
}

}  // namespace

int exitCodeOf(const Error& error) {
    log::error(error.message);
    return exitCode(error);
}

Result<WallSetup> checkSceneArguments(const SceneArguments& arguments) {
    WallSetup setup;
    const auto wall = parseSize("--size", arguments.size);
    if (!wall) return wall.error();
    setup.wall = *wall;
    const auto grid = parseGrid("--grid", arguments.grid);
    if (!grid) return grid.error();
    auto tiles = gridTiles(setup.wall, grid->columns, grid->rows);
    if (!tiles)
        return badInput(fmt::format("--grid {} --size {}: {}", arguments.grid, arguments.size, tiles.error().message));
    setup.tiles = std::move(*tiles);

    if (const auto stereo = checkStereo(arguments, setup); !stereo) return stereo.error();
    const auto camera = checkCamera(arguments);
    if (!camera) return camera.error();
    setup.stage.camera = *camera;
    setup.stage.noLights = arguments.lights.size() == 1 && arguments.lights.front() == "none";
    for (const std::string& text : arguments.lights) {
        if (setup.stage.noLights) break;
        if (text == "none") return badInput("--light none: no light at all, so there can be no other --light beside it");
        const auto light = parseLight(text);
        if (!light) return light.error();
        setup.stage.lights.push_back(*light);
    }
    if (const auto illumination = checkIllumination(arguments, setup.stage); !illumination) return illumination.error();
    setup.stage.shadowSet = arguments.shadowSet;
    const auto show = parseShow(arguments.show);
    if (!show) return show.error();
    setup.stage.show = *show;
    if (arguments.shadow != "auto") {
        const auto shadow = parseShadowMode(arguments.shadow);
        if (!shadow) return shadow.error();
        setup.stage.shadowMode = *shadow;
    }
    if (arguments.mapSize > 16384)
        return badInput(
            fmt::format("--map-size {}: expected 1 to 16384 texels, or 0 for the largest power of two within the wall",
                        arguments.mapSize));
    setup.stage.mapSize = arguments.mapSize;
    if (!arguments.background.empty()) {
        const auto colour = parseColour("--background", arguments.background);
        if (!colour) return colour.error();
        setup.stage.background = *colour;
    }

    setup.stage.brdf = arguments.brdf;
    if (!arguments.environment.empty()) {
        const auto environment = parseEnvironment(arguments.environment);
        if (!environment) return environment.error();
        setup.stage.environment = environment->file;
        setup.stage.captureEnvironment = environment->file.empty();
        setup.environment = *environment;
    }

    if (arguments.samples != 1 && arguments.samples != 4)
        return badInput(fmt::format("--samples {}: expected 1 or 4", arguments.samples));
    setup.samples = static_cast<std::uint32_t>(arguments.samples);
    if (arguments.colourBits) {
        const auto precision = parseColourBits(*arguments.colourBits);
        if (!precision) return precision.error();
        setup.colourPrecision = *precision;
    }
    if (arguments.tiles != "exact" && arguments.tiles != "offset")
        return badInput(fmt::format("--tiles '{}': expected exact or offset", arguments.tiles));
    setup.tileMode = arguments.tiles == "exact" ? TileMode::Exact : TileMode::Offset;

    const auto policy = parsePolicy("--policy", arguments.policy);
    if (!policy) return policy.error();
    setup.cluster.policy = *policy;
    if (arguments.latency != 0 && arguments.latency != 1)
        return badInput(fmt::format("--latency {}: expected 0 or 1 frame", arguments.latency));
    setup.cluster.latency = arguments.latency;
    setup.cluster.insecureLan = arguments.insecureLan;
    if (const auto servers = checkServers(arguments, setup.cluster); !servers) return servers.error();
    const int tileCount = static_cast<int>(setup.tiles.size());
    setup.cluster.local = arguments.local.value_or(std::min(tileCount, kMaxDefaultServers));
    if (setup.cluster.local < 1 || setup.cluster.local > 256)
        return badInput(fmt::format("--local {}: expected 1 to 256 servers", setup.cluster.local));
    setup.cluster.serverArguments = {"--log-level", arguments.logLevel};
    return setup;
}

Result<void> applyStoredShadows(const SceneArguments& arguments, Aspect& scene, Ref<Window> window) {
    if (arguments.shadow != "auto") return {};
    const auto path = tradeFileOf(arguments.scene);
    const auto stored = readTrade(path);
    if (!stored) return stored.error();
    if (!*stored) return {};
    const TradeSetting& chosen = (*stored)->chosen.setting;
    if (const auto applied = applySetting(scene, window, chosen); !applied)
        return badInput(fmt::format("{}: {}", path.string(), applied.error().message));
    log::info(fmt::format("{}: shadows as chosen by umbriel trade: {}", path.string(), labelOf(chosen)));
    return {};
}

Result<std::unique_ptr<LoadedStage>> loadStage(const std::string& scene, const TypeRegistry& types,
                                               const StageOptions& options, double aspectRatio) {
    auto result = std::make_unique<LoadedStage>();
    result->scene = std::make_unique<Aspect>(types, result->ids);
    if (isDemo(scene)) {
        const auto demo = buildDemo(scene, *result->scene);
        if (!demo) return demo.error();
        result->loaded = *demo;
    } else {
        auto file = loadScene(scene, *result->scene, result->ids, {});
        if (!file) return file.error();
        result->loaded = file->scene;
        result->warnings = std::move(file->warnings);
    }
    auto stage = buildStage(*result->scene, result->loaded, options, aspectRatio);
    if (!stage) return stage.error();
    result->stage = std::move(*stage);
    result->warnings.insert(result->warnings.end(), result->stage.warnings.begin(), result->stage.warnings.end());
    for (const std::string& warning : result->warnings) log::warning(fmt::format("{}: {}", scene, warning));
    for (const std::string& note : result->stage.notes) log::info(note);
    return result;
}

int runRender(const RenderArguments& arguments, const std::filesystem::path& serverProgram, std::ostream& out) {
    auto setup = checkSceneArguments(arguments.scene);
    if (!setup) return exitCodeOf(setup.error());
    if (arguments.frames < 1 || arguments.frames > 100'000'000)
        return exitCodeOf(badInput(fmt::format("--frames {}: expected 1 to 100000000", arguments.frames)));
    if (!(arguments.fps > 0.0) || !std::isfinite(arguments.fps))
        return exitCodeOf(badInput(fmt::format("--fps {}: expected more than 0 frames per second", arguments.fps)));
    if (!(std::abs(arguments.exposure) <= 100.0))
        return exitCodeOf(badInput(fmt::format("--exposure {}: expected -100 to 100 EV", arguments.exposure)));
    const auto toneMapping = toneMappingNamed(arguments.toneMapping);
    if (!toneMapping)
        return exitCodeOf(badInput(
            fmt::format("--tone-mapping '{}': expected clamp, exposure, reinhard or aces", arguments.toneMapping)));
    std::uint32_t layers = static_cast<std::uint32_t>(Layer::Colour);
    if (!arguments.layers.empty()) {
        const auto parsed = parseLayers(arguments.layers);
        if (!parsed) return exitCodeOf(parsed.error());
        layers = *parsed;
    }
    const auto files = OutputFiles::plan(arguments.out, arguments.frames);
    if (!files) return exitCodeOf(files.error());
    const ColourPrecision colours = setup->colourPrecision.value_or(precisionFor(arguments, *files));
    if (!files->empty() && std::int64_t{setup->wall.width} * setup->wall.height > kMaxFilePixels)
        return exitCodeOf(
            badInput(fmt::format("--size {}: one picture file holds at most {} pixels; leave --out away to draw "
                                 "without writing",
                                 arguments.scene.size, kMaxFilePixels)));

    TypeRegistry types;
    registerCoreTypes(types);
    const double aspectRatio = static_cast<double>(setup->wall.width) / setup->wall.height;
    auto loaded = loadStage(arguments.scene.scene, types, setup->stage, aspectRatio);
    if (!loaded) return exitCodeOf(loaded.error());
    Aspect& scene = *(*loaded)->scene;
    const Stage& stage = (*loaded)->stage;
    if (const auto stored = applyStoredShadows(arguments.scene, scene, stage.window); !stored)
        return exitCodeOf(stored.error());
    std::optional<FrameBudget> budget;
    if (arguments.scene.frameBudget) {
        auto begun = FrameBudget::begin(arguments.scene, scene, stage.window);
        if (!begun) return exitCodeOf(begun.error());
        budget.emplace(std::move(*begun));
    }
    if (const auto applied = applyLightMap(arguments.scene, scene, stage.window); !applied)
        return exitCodeOf(applied.error());

    setup->cluster.serverProgram = serverProgram;
    auto cluster = Cluster::connect(setup->cluster, types, setup->tiles);
    if (!cluster) return exitCodeOf(cluster.error());
    (*cluster)->measureCost(arguments.json);

    AnimationPlayer player(scene, (*loaded)->loaded);
    std::uint64_t captures = 0;
    if (setup->stage.captureEnvironment) {
        player.advanceTo(0.0, scene);
        const auto captured = captureEnvironment(**cluster, scene, stage, setup->environment);
        if (!captured) return exitCodeOf(captured.error());
        captures = *captured;
        if (const auto assigned = (*cluster)->assign(setup->tiles); !assigned) return exitCodeOf(assigned.error());
    }

    nlohmann::json frames = nlohmann::json::array();
    std::set<std::string> warned;  // each thing once
    std::vector<std::string> written;
    Progress progress("frame", arguments.frames, arguments.scene.quiet || arguments.json);
    HeldTiles tiles;
    const auto deliver = [&](FrameReport& report) -> Result<void> {
        if (report.frame <= captures) return {};  // with latency 1 the first frame is still drawn
        report.frame -= captures;
        if (!files->empty()) {
            tiles.take(std::move(report.tiles));
            for (const Eye eye : setup->eyes) {
                const std::string_view suffix = setup->eyes.size() == 1 ? "" : eye == Eye::Left ? "left" : "right";
                const auto paths = files->write(report.frame, suffix, assembleWall(setup->wall, tiles.all(), eye),
                                                arguments.exposure, *toneMapping);
                if (!paths) return paths.error();
                for (const auto& path : *paths) written.push_back(path.string());
            }
        }
        if (arguments.json) frames.push_back(toJson(report));
        if (budget) {
            if (arguments.json) frames.back()["shadow"] = labelOf(budget->setting());
            if (const auto followed = budget->follow(report); !followed) return followed.error();
        }
        progress.step();
        return {};
    };
    GeometryBounds bounds;  // of what stays the same from frame to frame
    for (std::uint64_t i = 0; i < arguments.frames; ++i) {
        const double time = static_cast<double>(i) / arguments.fps;
        player.advanceTo(time, scene);
        auto views = resolveViews(scene, stage.window, setup->wall, &bounds);
        if (!views) return exitCodeOf(views.error());
        for (const std::string& warning : views->warnings)
            if (warned.insert(warning).second) log::warning(warning);
        views->views.tiles = setup->tileMode;
        views->views.samples = setup->samples;
        views->views.colourPrecision = colours;
        views->views.layers = layers;
        auto report = (*cluster)->frame(scene, views->views, time, !files->empty());
        if (!report) return exitCodeOf(report.error());
        if (const auto delivered = deliver(*report); !delivered) return exitCodeOf(delivered.error());
    }
    for (bool more = true; more;) {
        auto last = (*cluster)->finish();
        if (!last) return exitCodeOf(last.error());
        more = last->has_value();
        if (!more) break;
        if (const auto delivered = deliver(**last); !delivered) return exitCodeOf(delivered.error());
    }
    progress.finish();

    if (arguments.explain) {
        auto plans = (*cluster)->explain();
        if (!plans) return exitCodeOf(plans.error());
        if (!arguments.json)
            for (const std::string& plan : *plans) out << plan << '\n';
    }
    const protocol::SwapSkew::Summary skew = (*cluster)->swapSkew();
    if (skew.frames > 0)
        log::info(fmt::format("swap skew of {} frames: median {:.0f}, p99 {:.0f}, max {:.0f} us, each within {:.0f} us",
                              skew.frames, toMilliseconds(skew.median) * 1e3, toMilliseconds(skew.p99) * 1e3,
                              toMilliseconds(skew.most) * 1e3, toMilliseconds(skew.bound) * 1e3));
    if (arguments.json) {
        out << nlohmann::json({{"scene", arguments.scene.scene},
                               {"size", {setup->wall.width, setup->wall.height}},
                               {"tiles", setup->tiles.size()},
                               {"frames", frames},
                               {"swap_skew", toJson(skew)},
                               {"files", written},
                               {"warnings", (*loaded)->warnings}})
                   .dump(2, ' ', false, nlohmann::json::error_handler_t::replace)
            << '\n';
    } else if (!arguments.scene.quiet) {
        for (const std::string& path : written) out << path << '\n';
    }
    if (files->empty() && !arguments.json && !arguments.explain && !arguments.scene.quiet)
        log::warning("nothing was written: name a file with --out, or ask for --json or --explain");
    return out.good() ? 0 : 1;
}

}  // namespace umbriel
