// What a bake on render servers costs: the frames they draw meanwhile, and processor time beside threads of one
// process.

#include <atomic>
#include <cmath>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <thread>

#include "client/app/mesh_input.h"
#include "client/app/render_command.h"
#include "client/bake/cluster_bake.h"
#include "client/bake/local_bake.h"
#include "client/session/cluster.h"
#include "client/session/views.h"
#include "common/base/log.h"
#include "common/scene/core_types.h"
#include "tests/bench/measure.h"
#include "tests/support/temporary_folder.h"

namespace {

using namespace umbriel;
using namespace umbriel::bench;
namespace fs = std::filesystem;

constexpr auto kPause = std::chrono::milliseconds(20);
constexpr double kMedianBound = 1.5;
constexpr double kSlowestBound = 3.0;
constexpr double kWorkBound = 1.05;

// Passes everything on until it is told to stop: then the bake ends.
class Stoppable final : public protocol::JobPort {
 public:
    explicit Stoppable(protocol::JobPort& port) : _port(port) {}
    std::atomic<bool> stop{false};
    std::size_t serverCount() const override { return _port.serverCount(); }
    std::uint32_t provide(std::vector<wire::Blob> blobs) override { return _port.provide(std::move(blobs)); }
    void finish() override { _port.finish(); }
    void offer(protocol::JobPeer peer, protocol::JobRequest request) override { _port.offer(peer, std::move(request)); }
    void cancel(protocol::JobPeer peer, std::uint64_t job, std::uint32_t attempt) override {
        _port.cancel(peer, job, attempt);
    }
    void fetch(protocol::JobPeer peer, const wire::BlobRef& result) override { _port.fetch(peer, result); }
    Result<std::vector<protocol::JobNews>> wait(Duration most) override {
        if (stop) return failure("stopped");
        return _port.wait(std::min<Duration>(most, std::chrono::milliseconds(20)));
    }

 private:
    protocol::JobPort& _port;
};

struct Subject {
    visibility::Mesh loaded;
    visibility::BakeMesh mesh;
    visibility::BakeSettings settings;
};

double percentile(std::vector<double> values, double share) {
    std::sort(values.begin(), values.end());
    const auto at = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5);
    return values[at];
}

// Frames of a scene on a cluster that may bake.
class Wall {
 public:
    Wall(const std::string& scene, int servers, const std::string& priority) {
        SceneArguments arguments;
        arguments.scene = scene;
        arguments.size = "640x360";
        arguments.grid = fmt::format("{}x1", servers);
        arguments.shadow = "std";
        arguments.local = servers;
        arguments.policy = "degrade";
        auto setup = need(checkSceneArguments(arguments));
        setup.cluster.serverArguments = {"--log-level", "off", "--bake-priority", priority};
        setup.cluster.serverProgram = fs::path(UMBRIEL_BIN_DIR) / "umbriel-server";
        registerCoreTypes(_types);
        _wall = setup.wall;
        _tiles = setup.tileMode;
        _stage = need(loadStage(scene, _types, setup.stage, static_cast<double>(_wall.width) / _wall.height));
        _cluster = need(Cluster::connect(setup.cluster, _types, setup.tiles));
        for (int i = 0; i < 10; ++i) frame();
    }
    double frame() {
        // The camera moves a little: views travel and every frame is new.
        _time += 0.04;
        const Ref<Transform> pose = _stage->stage.cameraPose;
        const glm::dvec3 at = _stage->scene->findAs<Transform>(pose.id)->translation.get();
        _stage->scene->edit(pose).set<&Transform::translation>(at + glm::dvec3(0.001 * std::sin(_time), 0.0, 0.0));
        auto views = need(resolveViews(*_stage->scene, _stage->stage.window, _wall));
        views.views.tiles = _tiles;
        return secondsOf([&] { need(_cluster->frame(*_stage->scene, views.views, _time, false)); });
    }
    std::vector<double> frames(int count) {
        std::vector<double> seconds;
        for (int i = 0; i < count; ++i) {
            seconds.push_back(frame());
            // As between the frames of a live wall: the bake has time to fill the caches.
            std::this_thread::sleep_for(kPause);
        }
        return seconds;
    }
    protocol::JobPort& jobs() { return _cluster->jobs(); }

 private:
    TypeRegistry _types;
    PixelSize _wall;
    TileMode _tiles{};
    std::unique_ptr<LoadedStage> _stage;
    std::unique_ptr<Cluster> _cluster;
    double _time = 0.0;
};

void drawing(const Report& report, const Subject& subject, const std::string& scene, int servers,
             const std::string& priority, int frames, int rounds, const fs::path& folder) {
    Wall wall(scene, servers, priority);
    std::vector<double> medians[2], slowest[2], medianRatios, slowestRatios, rates;
    for (int round = 0; round < rounds; ++round) {
        const auto alone = wall.frames(frames);
        Stoppable port(wall.jobs());
        std::atomic<std::uint64_t> blocks{0};
        std::atomic<bool> begun{false}, over{false};
        std::thread bake([&] {
            ClusterBakeOptions options{.out = folder / fmt::format("{}{}.umvis", priority, round), .shards = 1000};
            options.coordinator.auditShare = 0.0;
            options.progress = [&](std::uint64_t done, std::uint64_t) {
                blocks = done;
                begun = true;
            };
            options.notice = [](const std::string& text) { std::fprintf(stderr, "bench: %s\n", text.c_str()); };
            const auto baked =
                bakeOnCluster(subject.loaded, subject.mesh, subject.settings, options, port, SteadyClock());
            if (!baked && !port.stop) std::fprintf(stderr, "bench: %s\n", baked.error().message.c_str());
            over = true;
        });
        while (!begun && !over) wall.frame();
        const std::uint64_t before = blocks;
        std::vector<double> beside;
        const double seconds = secondsOf([&] { beside = wall.frames(frames); });
        if (over) {
            std::fprintf(stderr, "bench: the bake was over before the frames were; give a larger --bake-size\n");
            std::exit(1);
        }
        rates.push_back(static_cast<double>(blocks - before) * visibility::kRowsPerBlock *
                        visibility::pixelCount(subject.settings.mapping) / seconds * 1e-6);
        port.stop = true;
        bake.join();
        const std::vector<double>* both[2] = {&alone, &beside};
        for (int i = 0; i < 2; ++i) {
            medians[i].push_back(percentile(*both[i], 0.5) * 1e3);
            slowest[i].push_back(percentile(*both[i], 0.99) * 1e3);
        }
        medianRatios.push_back(medians[1].back() / medians[0].back());
        slowestRatios.push_back(slowest[1].back() / slowest[0].back());
    }
    const std::string what = fmt::format("{} servers, {}", servers, priority);
    report.figure(fmt::format("frame, median ({})", what), median(medians[0]), "ms");
    report.figure(fmt::format("frame beside a bake, median ({})", what), median(medians[1]), "ms");
    report.figure(fmt::format("  of what it was ({})", what), median(medianRatios), "", kMedianBound);
    report.figure(fmt::format("frame, p99 ({})", what), median(slowest[0]), "ms");
    report.figure(fmt::format("frame beside a bake, p99 ({})", what), median(slowest[1]), "ms");
    report.figure(fmt::format("  of what it was ({})", what), median(slowestRatios), "", kSlowestBound);
    report.figure(fmt::format("baked meanwhile ({})", what), median(rates), "Mray/s");
}

void work(const Report& report, const Subject& subject, int servers, int rounds, const fs::path& folder) {
    const auto threads = [&] {
        return need(bakeLocally(subject.mesh, subject.settings, {.out = folder / "work.umvis"})).cpuSeconds;
    };
    const auto cluster = [&](double audit) {
        ClusterOptions options;
        options.local = servers;
        options.policy = FailurePolicy::Degrade;
        options.serverProgram = fs::path(UMBRIEL_BIN_DIR) / "umbriel-server";
        options.serverArguments = {"--bake-threads", "1", "--bake-priority", "normal"};
        TypeRegistry types;
        registerCoreTypes(types);
        const auto connected = need(Cluster::connect(options, types, {}));
        ClusterBakeOptions bake{.out = folder / "work.umvis"};
        bake.coordinator.auditShare = audit;
        return need(bakeOnCluster(subject.loaded, subject.mesh, subject.settings, bake, connected->jobs(),
                                  SteadyClock()))
            .cpuSeconds;
    };
    const Rounds seconds = interleaved(
        rounds, threads, [&] { return cluster(0.0); }, [&] { return cluster(0.02); });
    report.figure("processor time of a bake, threads", seconds[0], "s");
    report.figure(fmt::format("processor time of it on {} servers", servers), seconds[1], "s");
    report.figure("  of the threads'", seconds.ratio({1}, 0), "", kWorkBound);
    report.figure("  of the threads', with audits", seconds.ratio({2}, 0), "");
}

}  // namespace

int main(int argc, char** argv) {
    log::setLevel("error");
    const Report report(hasFlag(argc, argv, "--json"));
    const int frames = std::atoi(option(argc, argv, "--frames", "150").c_str());
    const int rounds = std::atoi(option(argc, argv, "--rounds", "5").c_str());
    const int servers = std::atoi(option(argc, argv, "--servers", "2").c_str());
    const std::string scene = option(argc, argv, "--scene", "demo:city");
    Subject subject;
    subject.loaded = need(concatenated(need(loadMeshes(option(argc, argv, "--mesh", "demo:cloth")))));
    subject.mesh = need(visibility::prepare(subject.loaded));
    const test::TemporaryFolder own;
    const fs::path folder = own.path();

    subject.settings.mapping = {visibility::MappingKind::HemiSphere, 32};
    work(report, subject, servers, rounds, folder);
    subject.settings.mapping.size =
        static_cast<std::uint32_t>(std::atoi(option(argc, argv, "--bake-size", "128").c_str()));
    drawing(report, subject, scene, servers, "idle", frames, rounds, folder);
    if (hasFlag(argc, argv, "--normal")) drawing(report, subject, scene, servers, "normal", frames, rounds, folder);
    return 0;
}
