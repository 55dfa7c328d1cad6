// Latency 1: a client that works for 20 ms and a server that draws for 20 ms, at the same time.

#include <filesystem>
#include <memory>

#include "client/session/cluster.h"
#include "common/scene/core_types.h"
#include "common/scene/nodes.h"
#include "tests/bench/measure.h"

namespace umbriel {
namespace {

constexpr int kRounds = 5;
constexpr int kFrames = 60;
constexpr double kWork = 0.020;  // seconds

// False where this version has no such option.
template <class Options>
bool setLatency(Options& options, int latency) {
    if constexpr (requires { options.latency; }) {
        options.latency = latency;
        return true;
    } else {
        return latency == 0;
    }
}

void spin(double seconds) {
    for (const double end = bench::secondsNow() + seconds; bench::secondsNow() < end;) {
    }
}

std::unique_ptr<Cluster> connect(const TypeRegistry& types, int latency) {
    ClusterOptions options;
    options.local = 1;
    options.serverProgram = std::filesystem::path(UMBRIEL_BIN_DIR) / "bench_server";
    options.serverArguments = {"--answer", "draw", "--draw-ms", "20"};
    if (!setLatency(options, latency)) return nullptr;
    return bench::need(Cluster::connect(options, types, {{0, {0, 0, 16, 16}, Eye::Mono}}));
}

}  // namespace
}  // namespace umbriel

int main(int argc, char** argv) {
    using namespace umbriel;
    const bench::Report report(bench::hasFlag(argc, argv, "--json"));
    TypeRegistry types;
    registerCoreTypes(types);
    const auto inStep = connect(types, 0);
    const auto overlapping = connect(types, 1);
    if (!overlapping) {
        report.skipped("overlap: client 20 ms, server 20 ms", "this version has no latency 1");
        return 0;
    }
    WallViews views;
    views.wall = {16, 16};
    views.views.emplace_back();
    views.views.back().region = {0, 0, 16, 16};
    const auto frameTime = [&](Cluster& cluster, Aspect& scene) {
        return bench::secondsOf([&] {
                   for (int i = 0; i < kFrames; ++i) {
                       spin(kWork);
                       bench::need(cluster.frame(scene, views, i, false));
                   }
               }) /
               kFrames;
    };
    IdSource ids;
    Aspect first(types, ids);
    Aspect second(types, ids);
    const auto seconds = bench::interleaved(
        kRounds, [&] { return frameTime(*inStep, first); }, [&] { return frameTime(*overlapping, second); });
    report.figure("overlap: client 20 ms, server 20 ms, latency 0", seconds[0] * 1e3, "ms");
    report.figure("overlap: client 20 ms, server 20 ms, latency 1", seconds[1] * 1e3, "ms", 26.0);
    return 0;
}
