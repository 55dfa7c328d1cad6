#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>

#include <functional>
#include <optional>

#include "client/session/cluster.h"
#include "client/session/server_process.h"
#include "common/scene/core_types.h"
#include "common/scene/nodes.h"
#include "tests/support/reserved_port.h"
#include "tests/support/wait_until.h"

namespace umbriel {
namespace {

const std::filesystem::path kServer = std::filesystem::path(UMBRIEL_BIN_DIR) / "umbriel-server";

struct EmbeddedServers : testing::Test {
    TypeRegistry types;
    IdSource ids;
    ClusterOptions options;
    std::vector<TileAssignment> tiles;
    WallViews views;

    EmbeddedServers() {
        registerCoreTypes(types);
        options.serverProgram = kServer;
        options.local = 2;
        options.connectTimeout = test::kPatience;
        for (std::uint32_t i = 0; i < 4; ++i) tiles.push_back({i, {static_cast<int>(i) * 32, 0, 32, 24}, Eye::Mono});
        views.wall = {128, 24};
        views.views.emplace_back();
        views.views.back().region = {0, 0, 128, 24};
    }
};

TEST_F(EmbeddedServers, DrawFramesInStepAndEndWithTheirClient) {
    {
        auto cluster = Cluster::connect(options, types, tiles);
        ASSERT_TRUE(cluster) << cluster.error().message;
        Aspect scene(types, ids);
        scene.create<Transform>("nothing to see");
        for (int i = 0; i < 5; ++i) {
            auto frame = (*cluster)->frame(scene, views, i, true);
            ASSERT_TRUE(frame) << frame.error().message;
            EXPECT_EQ(frame->tiles.size(), 4u);
            ASSERT_EQ(frame->servers.size(), 2u);
            EXPECT_EQ(frame->servers[0].digest, frame->servers[1].digest);
        }
        EXPECT_EQ((*cluster)->serverDescriptions().size(), 2u);
    }
}

TEST_F(EmbeddedServers, OfAProgramThatIsNotThereAreAnError) {
    options.serverProgram = "/nowhere/umbriel-server";
    const auto cluster = Cluster::connect(options, types, tiles);
    ASSERT_FALSE(cluster);
    EXPECT_NE(cluster.error().message.find("/nowhere/umbriel-server"), std::string::npos) << cluster.error().message;
}

TEST_F(EmbeddedServers, ThatAreKilledAreNamedAtOnce) {
    std::vector<ServerProcess> processes;
    for (const std::string name : {"left", "right"}) {
        auto process = ServerProcess::start(kServer, {"--name", name, "--listen", "127.0.0.1:0"}, {});
        ASSERT_TRUE(process) << process.error().message;
        const auto port = process->waitForPort(test::kPatience);
        ASSERT_TRUE(port) << port.error().message;
        options.servers.push_back({name, "127.0.0.1", *port});
        processes.push_back(std::move(*process));
    }
    auto cluster = Cluster::connect(options, types, tiles);
    ASSERT_TRUE(cluster) << cluster.error().message;
    Aspect scene(types, ids);
    ASSERT_TRUE((*cluster)->frame(scene, views, 0.0, false));
    ::kill(processes[1].pid(), SIGKILL);
    const auto frame = (*cluster)->frame(scene, views, 1.0, false);
    ASSERT_FALSE(frame);
    EXPECT_NE(frame.error().message.find("server 'right'"), std::string::npos) << frame.error().message;
}

TEST_F(EmbeddedServers, ThatAreKilledAndStartedAgainComeBackWhileTheOthersDraw) {
    const auto start = [](const std::string& name, std::uint16_t port) {
        return ServerProcess::start(kServer, {"--name", name, "--listen", "127.0.0.1:" + std::to_string(port)}, {});
    };
    const test::ReservedPort ports[2];  // theirs while they are away, too
    std::vector<ServerProcess> processes;
    for (const std::string name : {"left", "right"}) {
        auto process = start(name, ports[processes.size()].number());
        ASSERT_TRUE(process) << process.error().message;
        const auto port = process->waitForPort(test::kPatience);
        ASSERT_TRUE(port) << port.error().message;
        options.servers.push_back({name, "127.0.0.1", *port});
        processes.push_back(std::move(*process));
    }
    options.policy = FailurePolicy::Degrade;
    auto cluster = Cluster::connect(options, types, tiles);
    ASSERT_TRUE(cluster) << cluster.error().message;
    Aspect scene(types, ids);
    const auto transform = scene.create<Transform>("wheel");
    double time = 0.0;
    const auto draw = [&] {
        scene.edit(transform).set<&Transform::translation>(glm::dvec3(time += 1.0));
        return (*cluster)->frame(scene, views, time, false);
    };
    ASSERT_TRUE(draw());
    std::optional<FrameReport> last;
    const auto drawUntil = [&](const std::function<bool()>& condition) {
        return test::waitUntil([&] {
            auto frame = draw();
            EXPECT_TRUE(frame) << frame.error().message;
            if (!frame) return true;
            last = std::move(*frame);
            return condition();
        });
    };
    const std::vector<std::string> right{"right"};
    ::kill(processes[1].pid(), SIGKILL);
    processes.pop_back();
    EXPECT_TRUE(drawUntil([&] { return last->lost == right; }));
    auto again = start("right", options.servers[1].port);
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_TRUE(drawUntil([&] { return last->rejoined == right; }));
    // A busy machine may make one or the other late again.
    EXPECT_TRUE(drawUntil([&] { return last->late.empty() && last->lost.empty(); }));
    EXPECT_EQ(last->servers[0].digest, last->servers[1].digest);
}

TEST_F(EmbeddedServers, ThatAreStoppedAreNamedWithinSeconds) {
    auto process = ServerProcess::start(kServer, {"--name", "left", "--listen", "127.0.0.1:0"}, {});
    ASSERT_TRUE(process) << process.error().message;
    const auto port = process->waitForPort(test::kPatience);
    ASSERT_TRUE(port) << port.error().message;
    options.servers.push_back({"left", "127.0.0.1", *port});
    auto cluster = Cluster::connect(options, types, tiles);
    ASSERT_TRUE(cluster) << cluster.error().message;
    Aspect scene(types, ids);
    ::kill(process->pid(), SIGSTOP);
    const auto frame = (*cluster)->frame(scene, views, 0.0, false);
    ::kill(process->pid(), SIGCONT);
    ASSERT_FALSE(frame);
    EXPECT_NE(frame.error().message.find("server 'left' has been silent for 2.0 s"), std::string::npos)
        << frame.error().message;
}

TEST(ServerProcess, EndsWhenItsParentLetsGo) {
    pid_t pid = 0;
    {
        auto process = ServerProcess::start(kServer, {"--listen", "127.0.0.1:0"}, {});
        ASSERT_TRUE(process) << process.error().message;
        const auto port = process->waitForPort(test::kPatience);
        ASSERT_TRUE(port) << port.error().message;
        pid = process->pid();
        EXPECT_EQ(::kill(pid, 0), 0);
    }
    EXPECT_EQ(::waitpid(pid, nullptr, WNOHANG), -1) << "it was reaped: no child of ours any more";
}

}  // namespace
}  // namespace umbriel
