#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/session/cluster.h"
#include "client/session/server_process.h"
#include "common/base/log.h"
#include "common/scene/core_types.h"
#include "common/scene/nodes.h"
#include "tests/sim/random.h"
#include "tests/support/reserved_port.h"
#include "tests/support/wait_until.h"

namespace umbriel {
namespace {

const std::filesystem::path kServer = std::filesystem::path(UMBRIEL_BIN_DIR) / "umbriel-server";

std::size_t residentBytes() {
    std::ifstream file("/proc/self/statm");
    std::size_t all = 0, resident = 0;
    file >> all >> resident;
    return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

double secondsNow() {
    return toSeconds(SteadyClock().now() - TimePoint{});
}

// A 2x2 wall of real servers whose scene moves. Random servers are killed and started again, or stopped and continued;
// UMBRIEL_CHAOS_EVENTS of them (12). Times are printed, not judged: they are the machine's as well.
TEST(Chaos, KilledAndStoppedServersComeBackAndTheOthersGoOn) {
    const char* wanted = std::getenv("UMBRIEL_CHAOS_EVENTS");
    const int events = wanted ? std::atoi(wanted) : 12;
    log::setLevel("error");
    TypeRegistry types;
    registerCoreTypes(types);
    ClusterOptions options;
    options.policy = FailurePolicy::Degrade;
    options.connectTimeout = test::kPatience;
    std::vector<TileAssignment> tiles;
    std::vector<std::unique_ptr<ServerProcess>> processes;
    const auto start = [&](std::size_t i, std::uint16_t port) {
        return ServerProcess::start(
            kServer, {"--name", "s" + std::to_string(i), "--listen", "127.0.0.1:" + std::to_string(port)},
            {"LP_NUM_THREADS=0"});
    };
    const test::ReservedPort ports[4];  // theirs while they are away, too
    for (std::size_t i = 0; i < 4; ++i) {
        auto process = start(i, ports[i].number());
        ASSERT_TRUE(process) << process.error().message;
        const auto port = process->waitForPort(test::kPatience);
        ASSERT_TRUE(port) << port.error().message;
        options.servers.push_back({"s" + std::to_string(i), "127.0.0.1", *port});
        processes.push_back(std::make_unique<ServerProcess>(std::move(*process)));
        const int x = static_cast<int>(i % 2) * 160, y = static_cast<int>(i / 2) * 90;
        tiles.push_back({static_cast<std::uint32_t>(i), {x, y, 160, 90}, Eye::Mono});
    }
    auto cluster = Cluster::connect(options, types, tiles);
    ASSERT_TRUE(cluster) << cluster.error().message;
    IdSource ids;
    Aspect scene(types, ids);
    const auto wheel = scene.create<Transform>("wheel");
    WallViews views;
    views.wall = {320, 180};
    views.views.emplace_back();
    views.views.back().region = {0, 0, 320, 180};

    sim::Random random(7);
    double time = 0.0, longestFrame = 0.0, longestReturn = 0.0;
    std::uint64_t frames = 0;
    bool whole = false;
    const auto draw = [&]() -> Result<FrameReport> {
        scene.edit(wheel).set<&Transform::translation>(glm::dvec3(time += 0.04));
        const double begun = secondsNow();
        auto report = (*cluster)->frame(scene, views, time, false);
        if (++frames > 1) longestFrame = std::max(longestFrame, secondsNow() - begun);
        if (report) {
            whole = report->late.empty() && report->lost.empty();
            std::optional<std::uint64_t> digest;
            for (const ServerReport& server : report->servers) {
                if (!server.shown) continue;
                EXPECT_EQ(server.digest, digest.value_or(server.digest)) << server.name << ", frame " << report->frame;
                digest = server.digest;
            }
        }
        return report;
    };
    const auto drawFor = [&](double seconds) {
        for (const double end = secondsNow() + seconds; secondsNow() < end;) {
            const auto report = draw();
            ASSERT_TRUE(report) << report.error().message;
        }
    };
    drawFor(0.5);
    const std::size_t memoryBefore = residentBytes();
    for (int event = 0; event < events; ++event) {
        const auto victim = static_cast<std::size_t>(random.between(0, 3));
        if (event % 2 == 0) {
            ::kill(processes[victim]->pid(), SIGKILL);
            processes[victim].reset();
            drawFor(0.1);
            auto again = start(victim, options.servers[victim].port);
            ASSERT_TRUE(again) << again.error().message;
            processes[victim] = std::make_unique<ServerProcess>(std::move(*again));
            // The driver's start is not the cluster's: its return counts from when it listens.
            ASSERT_TRUE(processes[victim]->waitForPort(test::kPatience));
        } else {
            ::kill(processes[victim]->pid(), SIGSTOP);
            drawFor(static_cast<double>(random.between(100, 3000)) / 1000.0);
            ::kill(processes[victim]->pid(), SIGCONT);
        }
        const double back = secondsNow();
        do {
            const auto report = draw();
            ASSERT_TRUE(report) << report.error().message;
            ASSERT_LT(secondsNow() - back, toSeconds(test::kPatience)) << "server s" << victim << " does not come back";
        } while (!whole);
        longestReturn = std::max(longestReturn, secondsNow() - back);
        drawFor(0.1);
    }
    std::printf(
        "%d events, %llu frames: longest frame %.3f s, longest time until the wall was whole %.3f s, memory %+.1f "
        "MiB\n",
        events, static_cast<unsigned long long>(frames), longestFrame, longestReturn,
        (static_cast<double>(residentBytes()) - static_cast<double>(memoryBefore)) / 1048576.0);
}

}  // namespace
}  // namespace umbriel
