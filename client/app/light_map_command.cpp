#include "client/app/light_map_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <ostream>

#include "client/app/arguments.h"
#include "client/app/exit_code.h"
#include "client/app/light_map_servers.h"
#include "client/app/progress.h"
#include "client/app/render_command.h"
#include "client/bake/mapped_file.h"
#include "client/bake/sha256.h"
#include "common/base/processor_time.h"
#include "common/image/exr_io.h"
#include "common/scene/core_types.h"

namespace umbriel {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kMostSamples = 16;
constexpr std::int64_t kLargestPicture = 16384;

bool isDrawn(const BakeArguments& a) {
    return a.from != "rays";
}

Result<void> check(const BakeArguments& a) {
    const std::int64_t size = *a.lightMap;
    if (size < 1 || size > LightMap::kMaxSize)
        return badInput(fmt::format("--light-map {}: expected 1 to {} texels along each side of the atlas", size,
                                    LightMap::kMaxSize));
    if (isDrawn(a)) {
        if (const auto mode = parseBakedMode(a.from); !mode)
            return badInput(fmt::format("--from {}", mode.error().message));
        if (a.local && !a.servers.empty())
            return badInput("--servers excludes --local: servers that run, or embedded ones");
        if (a.local && (*a.local < 1 || *a.local > 256))
            return badInput(fmt::format("--local {}: expected 1 to 256 servers", *a.local));
    } else {
        if (a.mapSize || !a.shadowSet.empty())
            return badInput("--map-size and --shadow-set: rays have no shadow maps; name a mode with --from");
        if (!a.servers.empty() || a.local)
            return badInput("--light-map: rays are traced by threads of this process, without --servers and --local");
    }
    if (a.mapSize && (*a.mapSize < 1 || *a.mapSize > 16384))
        return badInput(fmt::format("--map-size {}: expected 1 to 16384 texels", *a.mapSize));
    if (a.texelSamples < 1 || a.texelSamples > kMostSamples)
        return badInput(fmt::format("--samples {}: expected 1 to {} points along each side of a texel", a.texelSamples,
                                    kMostSamples));
    if (a.lightSamples < 1 || a.lightSamples > kMostSamples)
        return badInput(fmt::format("--light-samples {}: expected 1 to {} rays along each side of a light",
                                    a.lightSamples, kMostSamples));
    if (a.threads < 0 || a.threads > 4096)
        return badInput(fmt::format("--threads {}: expected 1 to 4096, or 0 for all", a.threads));
    if (!a.atlas.empty() && !a.atlas.ends_with(".exr"))
        return badInput(fmt::format("--atlas '{}': expected a name ending in .exr", a.atlas));
    if (!a.atlas.empty() && size > kLargestPicture)
        return badInput(
            fmt::format("--atlas: a picture has {} texels along each side at most, whose floats are 5 GiB; "
                        "leave it out, or bake a smaller map",
                        kLargestPicture));
    if (!a.out.empty() && !a.out.ends_with(".umlight"))
        return badInput(fmt::format("--out '{}': expected a name ending in .umlight", a.out));
    return {};
}

Result<DrawnLightMap> traceRays(const BakeArguments& a, const LoadedStage& loaded, const LightMapOptions& options) {
    auto file = bakeLightMapOf(*loaded.scene, loaded.stage.root, options, a.moving);
    if (!file) return file.error();
    return DrawnLightMap{std::move(*file), 0.0};
}

// On servers that run, or on embedded ones.
Result<DrawnLightMap> draw(const BakeArguments& a, LoadedStage& loaded, const LightMapOptions& options) {
    ClusterOptions setup;
    setup.local = a.local.value_or(1);
    setup.insecureLan = a.insecureLan;
    setup.serverArguments = {"--log-level", a.quiet ? "error" : "warning"};
    if (!a.servers.empty()) {
        auto servers = parseServers(a.servers);
        if (!servers) return servers.error();
        setup.servers = std::move(*servers);
    }
    return drawLightMapOf(std::move(setup), *loaded.scene, loaded.stage, options, a.moving);
}

Result<void> bake(const BakeArguments& a, std::ostream& out) {
    if (const auto checked = check(a); !checked) return checked.error();
    StageOptions stage;
    if (isDrawn(a)) {
        stage.shadowMode = *parseBakedMode(a.from);
        stage.mapSize = static_cast<std::uint32_t>(a.mapSize.value_or(kBakedMapSize));
        stage.shadowSet = a.shadowSet;
    }
    if (std::find(a.lights.begin(), a.lights.end(), "none") != a.lights.end())
        return badInput("--light none: a light map holds the shadows of lights; without any there is nothing to bake");
    for (const std::string& text : a.lights) {
        const auto light = parseLight(text);
        if (!light) return light.error();
        stage.lights.push_back(*light);
    }
    TypeRegistry types;
    registerCoreTypes(types);
    const auto loaded = loadStage(a.scene, types, stage, 1.0);
    if (!loaded) return loaded.error();
    LightMapOptions options;
    options.size = static_cast<std::uint32_t>(*a.lightMap);
    options.samples = a.texelSamples;
    options.lightSamples = a.lightSamples;
    options.threads = a.threads;
    std::optional<Progress> progress;
    options.progress = [&](std::uint64_t done, std::uint64_t all) {
        if (!progress) progress.emplace("baking", all, a.quiet);
        progress->at(done);
    };
    const auto begin = std::chrono::steady_clock::now();
    const Duration cpuBegin = processorTime();
    auto done = isDrawn(a) ? draw(a, **loaded, options) : traceRays(a, **loaded, options);
    if (progress) progress->finish();
    if (!done) return Error{done.error().kind, fmt::format("{}: {}", a.scene, done.error().message)};
    const LightMapFile* file = &done->file;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    const double cpuSeconds = toSeconds(processorTime() - cpuBegin) + done->serverSeconds;
    const std::filesystem::path path = a.out.empty() ? lightMapFileOf(a.scene) : std::filesystem::path(a.out);
    if (const auto written = writeLightMap(path, *file); !written) return written.error();
    if (!a.atlas.empty())
        if (const auto written = writeExr(a.atlas, atlasPicture(*file)); !written)
            return Error{written.error().kind,
                         fmt::format("{} is baked, its atlas is not: {}", path.string(), written.error().message)};

    const auto mapped = MappedFile::open(path);
    if (!mapped) return mapped.error();
    Sha256 sha;
    sha.add(mapped->bytes());
    const std::string hash = sha.finish();
    const BakedLightMap& baked = file->baked;
    const double covered = static_cast<double>(baked.covered) / (double(baked.size) * double(baked.size));
    if (a.json) {
        out << Json({{"from", a.from},
                     {"size", baked.size},
                     {"lights", file->lightNames},
                     {"surfaces", file->states.size()},
                     {"triangles", baked.places.size()},
                     {"charts", baked.chartCount},
                     {"covered", covered},
                     {"texel_metres", baked.texelMetres},
                     {"rays", baked.rays},
                     {"lookups", baked.lookups},
                     {"seconds", seconds},
                     {"cpu_seconds", cpuSeconds},
                     {"bytes", mapped->bytes().size()},
                     {"sha256", hash}})
                   .dump(2, ' ', false, Json::error_handler_t::replace)
            << '\n';
    } else if (!a.quiet) {
        out << fmt::format(
            "{} lights on {} surfaces ({} triangles in {} charts) in {} x {} texels, {:.0f} % of them covered, {:.3g} "
            "m a texel on the largest chart\n{} in {:.2f} s ({:.2f} s of processors)\nwrote {}, sha256 {}\n",
            file->lightStates.size(), file->states.size(), baked.places.size(), baked.chartCount, baked.size,
            baked.size, 100.0 * covered, baked.texelMetres,
            isDrawn(a) ? fmt::format("{} points of surfaces drawn", baked.lookups)
                       : fmt::format("{} rays traced", baked.rays),
            seconds, cpuSeconds, path.string(), hash);
    }
    if (!out.flush()) return failure("the result could not be written");
    return {};
}

}  // namespace

int runBakeLightMap(const BakeArguments& arguments, std::ostream& out, std::ostream& err) {
    return endCommand("umbriel bake", bake(arguments, out), err);
}

}  // namespace umbriel
