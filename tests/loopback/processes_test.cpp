#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "client/session/cluster.h"
#include "client/session/server_process.h"
#include "common/scene/core_types.h"
#include "common/scene/nodes.h"

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

TEST(ServerProcess, EndsWhenItsParentLetsGo) {
    pid_t pid = 0;
    {
        auto process = ServerProcess::start(kServer, {"--listen", "127.0.0.1:0"}, {});
        ASSERT_TRUE(process) << process.error().message;
        const auto port = process->waitForPort(std::chrono::seconds(30));
        ASSERT_TRUE(port) << port.error().message;
        pid = process->pid();
        EXPECT_EQ(::kill(pid, 0), 0);
    }
    EXPECT_NE(::kill(pid, 0), 0) << "it was reaped";
}

}  // namespace
}  // namespace umbriel
