#include "client/app/bake_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <ostream>
#include <thread>

#include "client/app/arguments.h"
#include "client/app/exit_code.h"
#include "client/app/mesh_input.h"
#include "client/app/progress.h"
#include "client/bake/atlas.h"
#include "client/bake/cluster_bake.h"
#include "client/bake/local_bake.h"
#include "client/bake/mapped_file.h"
#include "client/session/cluster.h"
#include "common/image/exr_io.h"
#include "common/scene/core_types.h"
#include "common/visibility/mesh_check.h"

namespace umbriel {
namespace {

using Json = nlohmann::ordered_json;
using visibility::BakeSettings;
using visibility::MapContent;
using visibility::MapMaker;
using visibility::MappingKind;

// Beyond these the ray nearest to the normal misses what lies right above the vertex.
constexpr double kFirstRayDegrees = 6.0;
constexpr double kFirstRayDegreesWide = 7.5;
constexpr double kWideFovyDegrees = 160.0;
constexpr int kMostLocalServers = 64;
// At 100 diagonals from the origin, where meshes may well stand, steps of coordinates are 1e-5 of the diagonal.
constexpr double kCoarse = 1e-4;

double radians(double degrees) {
    return degrees * std::numbers::pi / 180.0;
}

Result<BakeSettings> settingsOf(const BakeArguments& a) {
    BakeSettings settings;
    const auto kind = visibility::mappingKindNamed(a.mapping);
    if (!kind) {
        return badInput(fmt::format(
            "--mapping '{}': expected hemicube, singleplane, hemisphere, cube, octahedral or fibonacci", a.mapping));
    }
    settings.mapping = {*kind, a.size, 0.0};
    if (*kind == MappingKind::SinglePlane) {
        if (!a.fovy) return badInput("--mapping singleplane needs --fovy DEGREES, its full opening angle below 180");
        settings.mapping.fovy = radians(*a.fovy);
    } else if (a.fovy) {
        return badInput(fmt::format("--fovy belongs to --mapping singleplane, not to {}", a.mapping));
    }
    if (a.maker == "rays")
        settings.maker = MapMaker::Rays;
    else if (a.maker == "grid")
        settings.maker = MapMaker::Grid;
    else if (a.maker == "gl")
        settings.maker = MapMaker::Gl;
    else
        return badInput(fmt::format("--maker '{}': expected rays, grid or gl", a.maker));
    if (a.guard == "exact")
        settings.guard = trace::Guard::Exact;
    else if (a.guard == "fast")
        settings.guard = trace::Guard::Fast;
    else if (a.guard == "fast-fan")
        settings.guard = trace::Guard::FastFan;
    else
        return badInput(fmt::format("--guard '{}': expected exact, fast or fast-fan", a.guard));
    if (a.far) {
        if (!(*a.far > 0.0 && std::isfinite(*a.far))) {
            return badInput(
                fmt::format("--far {}: expected a number of percent of the mesh's diagonal, above 0; "
                            "without --far there is no limit",
                            *a.far));
        }
        settings.farShare = *a.far / 100.0;
    }
    if (a.distance) settings.contents |= static_cast<std::uint32_t>(MapContent::Distance);
    if (a.hitDistance) settings.contents |= static_cast<std::uint32_t>(MapContent::HitDistance);
    if (a.index) {
        settings.contents |= static_cast<std::uint32_t>(MapContent::Index);
        const auto size = parseSize("--environment", a.environment);
        if (!size) return size.error();
        settings.environment = {static_cast<std::uint32_t>(size->width), static_cast<std::uint32_t>(size->height)};
    }
    if (const auto valid = visibility::check(settings); !valid) return valid.error();
    return settings;
}

Result<ShardPart> parsePart(const std::string& text) {
    ShardPart part;
    const char* const end = text.data() + text.size();
    const auto number = std::from_chars(text.data(), end, part.number);
    if (number.ec == std::errc() && number.ptr != end && *number.ptr == '/') {
        const auto count = std::from_chars(number.ptr + 1, end, part.count);
        if (count.ec == std::errc() && count.ptr == end && part.number < part.count) return part;
    }
    return badInput(fmt::format("--shard '{}': expected i/n with i from 0 to n-1, as in 0/8", text));
}

// The rasteriser is the servers'.
bool onServers(const BakeArguments& a) {
    return !a.servers.empty() || a.local || a.maker == "gl";
}

Result<LocalBakeOptions> optionsOf(const BakeArguments& a) {
    if (!a.servers.empty() && a.local) return badInput("--servers and --local: give one of the two");
    if (a.local && (*a.local < 1 || *a.local > kMostLocalServers))
        return badInput(fmt::format("--local {}: expected 1 to {} servers", *a.local, kMostLocalServers));
    if (a.maker == "gl" && !a.shard.empty())
        return badInput("--maker gl: the maps are drawn by render servers, --shard i/n is baked by this process");
    if (onServers(a) && !a.shard.empty())
        return badInput("--shard i/n is baked by threads of one process: without --servers and --local");
    if (!a.servers.empty() && a.threads != 0)
        return badInput("--threads: how many a server uses is its own option, --bake-threads");
    if (!(a.audit >= 0.0 && a.audit <= 100.0))
        return badInput(fmt::format("--audit {}: expected 0 to 100 percent", a.audit));
    if (a.out.empty()) return badInput("--out FILE.umvis is missing: where the maps go");
    if (a.threads < 0 || a.threads > 4096) {
        return badInput(fmt::format("--threads {}: expected 1 to 4096, or 0 for all", a.threads));
    }
    if (!a.atlas.empty() && !a.atlas.ends_with(".exr")) {
        return badInput(fmt::format("--atlas '{}': expected a name ending in .exr", a.atlas));
    }
    if (sameFile(a.out, a.scene)) return badInput(fmt::format("--out '{}' is the mesh itself", a.out));
    if (!a.atlas.empty() && sameFile(a.atlas, a.out))
        return badInput(fmt::format("--atlas '{}' is the file of the maps: the picture would replace them", a.atlas));
    LocalBakeOptions options{.out = a.out, .threads = a.threads, .shards = a.shards, .resume = a.resume};
    if (!a.shard.empty()) {
        if (a.shards > 0) return badInput("--shards and --shard: give one of the two");
        const auto part = parsePart(a.shard);
        if (!part) return part.error();
        options.part = *part;
    }
    return options;
}

// Empty when the mapping looks closely enough along the normal.
std::string firstRayWarning(const visibility::Mapping& mapping) {
    if (visibility::directionFrame(mapping) == visibility::DirectionFrame::Object) return {};
    double best = -1.0;
    for (std::uint32_t pixel = 0; pixel < visibility::pixelCount(mapping); ++pixel) {
        best = std::max(best, visibility::direction(mapping, pixel).z);
    }
    const double degrees = std::acos(std::min(best, 1.0)) * 180.0 / std::numbers::pi;
    const double limit = mapping.fovy >= radians(kWideFovyDegrees) ? kFirstRayDegreesWide : kFirstRayDegrees;
    if (degrees <= limit) return {};
    return fmt::format(
        "the ray nearest to the normal is {:.1f} degrees off it: what lies right above a vertex may be "
        "missed; a larger --size helps",
        degrees);
}

Result<void> writeAtlas(const BakeArguments& a) {
    const auto mapped = MappedFile::open(a.out);
    if (!mapped) return mapped.error();
    const auto file = visibility::MapFile::open(mapped->bytes(), a.out);
    if (!file) return file.error();
    const auto picture = exportAtlas(*file, {});
    if (!picture) return picture.error();
    return writeExr(a.atlas, *picture);
}

// What both ways of baking tell.
struct Outcome {
    std::uint64_t rows = 0;
    std::uint64_t rays = 0;
    double seconds = 0.0;
    double cpuSeconds = 0.0;
    std::uint32_t servers = 0;
    std::uint32_t shards = 0;
    std::uint32_t redone = 0;
    std::uint32_t audited = 0;
    std::string sha256;
};

Result<Outcome> bakeHere(const visibility::BakeMesh& mesh, const BakeSettings& settings, LocalBakeOptions options) {
    const auto o = bakeLocally(mesh, settings, options);
    if (!o) return o.error();
    return Outcome{o->rows, o->rays, o->seconds, o->cpuSeconds, 0, o->shards, o->redone, 0, o->sha256};
}

Result<Outcome> bakeThere(const BakeArguments& a, visibility::Mesh loaded, const visibility::BakeMesh& mesh,
                          const BakeSettings& settings, const LocalBakeOptions& options, std::ostream& err) {
    ClusterOptions cluster;
    if (a.servers.empty()) {
        cluster.local = a.local.value_or(1);
        const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
        const int threads = a.threads > 0 ? a.threads : std::max(1, cores / cluster.local);
        // They are there for this alone.
        cluster.serverArguments = {"--bake-threads", fmt::format("{}", threads), "--bake-priority", "normal"};
    } else {
        const auto servers = parseServers(a.servers);
        if (!servers) return servers.error();
        cluster.servers = *servers;
    }
    cluster.insecureLan = a.insecureLan;
    cluster.policy = FailurePolicy::Degrade;  // a lost server is none of the others' business
    cluster.startIncomplete = true;
    TypeRegistry types;
    registerCoreTypes(types);
    const auto connected = Cluster::connect(cluster, types, {});
    if (!connected) return connected.error();
    ClusterBakeOptions baking{.out = options.out, .shards = options.shards, .resume = options.resume};
    baking.coordinator.auditShare = a.audit / 100.0;
    baking.progress = options.progress;
    baking.notice = [&](const std::string& text) {
        if (!a.quiet) err << fmt::format("warning: {}\n", text) << std::flush;
    };
    const auto o = bakeOnCluster(std::move(loaded), mesh, settings, baking, (*connected)->jobs(), SteadyClock());
    if (!o) return o.error();
    return Outcome{o->rows,   o->rays,   o->seconds, o->cpuSeconds, o->servers,
                   o->shards, o->redone, o->audited, o->sha256};
}

Result<void> bake(const BakeArguments& a, std::ostream& out, std::ostream& err) {
    const auto settings = settingsOf(a);
    if (!settings) return settings.error();
    auto options = optionsOf(a);
    if (!options) return options.error();
    const auto input = loadMeshes(a.scene);
    if (!input) return input.error();
    auto loaded = concatenated(*input);
    if (!loaded) return loaded.error();
    const auto mesh = visibility::prepare(*loaded);
    if (!mesh) return badInput(fmt::format("{}: {}", a.scene, mesh.error().message));

    std::vector<std::string> warnings = input->warnings;
    if (mesh->unlitVertices > 0) {
        warnings.push_back(
            fmt::format("{} vertices have no triangle with an area and get no map", mesh->unlitVertices));
    }
    if (mesh->degenerateTriangles > 0) {
        warnings.push_back(fmt::format("{} triangles without area are left out", mesh->degenerateTriangles));
    }
    if (const std::uint64_t edges = visibility::inconsistentEdges(*loaded); edges > 0) {
        warnings.push_back(fmt::format(
            "triangles at {} edges are wound to different sides, so normals and maps there point to either; "
            "umbriel check MESH --orient --out SOUND.obj turns them",
            edges));
    }
    if (const double share = visibility::coarseness(*loaded); share > kCoarse) {
        warnings.push_back(
            fmt::format("so far from the origin its coordinates are rounded to {:.2g} of the mesh's diagonal, and its "
                        "maps are those "
                        "of the rounded shape; move it nearer",
                        share));
    }
    if (std::string warning = firstRayWarning(settings->mapping); !warning.empty()) warnings.push_back(warning);
    if (!a.quiet) {
        for (const std::string& warning : warnings) err << fmt::format("warning: {}: {}\n", a.scene, warning);
    }

    std::optional<Progress> progress;
    options->progress = [&](std::uint64_t done, std::uint64_t all) {
        if (!progress) progress.emplace("baking", all, a.quiet);
        progress->at(done);
    };
    const auto outcome = onServers(a) ? bakeThere(a, std::move(*loaded), *mesh, *settings, *options, err)
                                      : bakeHere(*mesh, *settings, *options);
    if (progress) progress->finish();
    if (!outcome) return outcome.error();
    if (!a.atlas.empty()) {
        if (const auto written = writeAtlas(a); !written) {
            return Error{written.error().kind,
                         fmt::format("{} is baked, its atlas is not: {}", a.out, written.error().message)};
        }
    }

    const std::uint32_t directions = visibility::pixelCount(settings->mapping);
    const double rate = outcome->cpuSeconds > 0.0 ? static_cast<double>(outcome->rays) / outcome->cpuSeconds : 0.0;
    if (a.json) {
        Json json = {
            {"vertices", outcome->rows},   {"directions", directions},           {"rays", outcome->rays},
            {"seconds", outcome->seconds}, {"cpu_seconds", outcome->cpuSeconds}, {"rays_per_core_second", rate},
            {"servers", outcome->servers}, {"shards", outcome->shards},          {"redone", outcome->redone},
            {"sha256", outcome->sha256}};
        if (onServers(a)) json["audited"] = outcome->audited;
        out << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    } else if (!a.quiet) {
        out << fmt::format(
            "{} vertices x {} directions, {} rays traced in {:.2f} s ({:.2f} s of processors, {:.2f} "
            "million rays per core second)\n",
            outcome->rows, directions, outcome->rays, outcome->seconds, outcome->cpuSeconds, rate * 1e-6);
        out << fmt::format("{} shards, {} redone", outcome->shards, outcome->redone);
        if (onServers(a)) out << fmt::format(", {} audited, on {} servers", outcome->audited, outcome->servers);
        out << fmt::format("\nwrote {}, sha256 {}\n", a.out, outcome->sha256);
        if (!a.atlas.empty()) out << fmt::format("wrote {}\n", a.atlas);
    }
    if (!out.flush()) return failure("the result could not be written");
    return {};
}

Result<void> merge(const BakeMergeArguments& a, std::ostream& out) {
    if (a.out.empty()) return badInput("--out FILE.umvis is missing: where the maps go");
    if (a.shards.empty()) return badInput("which shards? Name all files that bake --shard i/n has made");
    const auto outcome = mergeFiles(a.shards, a.out, a.allowMixed);
    if (!outcome) return outcome.error();
    const std::uint32_t directions = visibility::pixelCount(outcome->header.mapping);
    if (a.json) {
        const Json json = {{"vertices", outcome->header.totalRows},
                           {"directions", directions},
                           {"shards", a.shards.size()},
                           {"sha256", outcome->sha256}};
        out << json.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    } else {
        out << fmt::format("{} vertices x {} directions of {} shards\nwrote {}, sha256 {}\n", outcome->header.totalRows,
                           directions, a.shards.size(), a.out, outcome->sha256);
    }
    if (!out.flush()) return failure("the result could not be written");
    return {};
}

}  // namespace

int runBake(const BakeArguments& arguments, std::ostream& out, std::ostream& err) {
    return endCommand("umbriel bake", bake(arguments, out, err), err);
}

int runBakeMerge(const BakeMergeArguments& arguments, std::ostream& out, std::ostream& err) {
    return endCommand("umbriel bake merge", merge(arguments, out), err);
}

}  // namespace umbriel
