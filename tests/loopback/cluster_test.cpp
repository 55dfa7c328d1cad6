#include "client/session/cluster.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <future>
#include <set>
#include <thread>

#include "common/scene/core_types.h"
#include "common/scene/materials.h"
#include "common/scene/nodes.h"
#include "server/session/render_server.h"
#include "tests/support/fake_renderer.h"
#include "tests/support/reserved_port.h"
#include "tests/support/wait_until.h"

namespace umbriel {
namespace {

// Render servers as threads of this process, each with a fake renderer.
class Servers {
 public:
    Servers(const TypeRegistry& types, int count) {
        for (int i = 0; i < count; ++i) {
            auto& one = *_all.emplace_back(std::make_unique<One>());
            std::promise<std::uint16_t> port;
            RenderServerOptions options;
            options.name = "server" + std::to_string(i);
            options.build = "test";
            options.listening = [&port](std::uint16_t value) { port.set_value(value); };
            one.server = std::make_unique<RenderServer>(std::move(options), types, one.renderer);
            one.thread = std::thread([&one] { one.result = one.server->run(); });
            addresses.push_back({"server" + std::to_string(i), "127.0.0.1", port.get_future().get()});
        }
    }
    ~Servers() {
        for (auto& one : _all) one->server->stop();
        for (auto& one : _all) one->thread.join();
    }
    test::FakeRenderer& renderer(std::size_t i) { return _all[i]->renderer; }

    std::vector<ServerAddress> addresses;

 private:
    struct One {
        test::FakeRenderer renderer;
        std::unique_ptr<RenderServer> server;
        std::thread thread;
        Result<void> result;
    };
    std::vector<std::unique_ptr<One>> _all;
};

std::vector<TileAssignment> row(int count, int size) {
    std::vector<TileAssignment> tiles;
    for (int i = 0; i < count; ++i)
        tiles.push_back({static_cast<std::uint32_t>(i), {i * size, 0, size, size}, Eye::Mono});
    return tiles;
}

WallViews viewsOf(int width, int height) {
    WallViews views;
    views.wall = {width, height};
    views.views.emplace_back();
    views.views.back().region = {0, 0, width, height};
    return views;
}

struct ClusterOnLoopback : testing::Test {
    TypeRegistry types;
    IdSource ids;
    ClusterOnLoopback() { registerCoreTypes(types); }

    Result<std::unique_ptr<Cluster>> connect(const Servers& servers, std::vector<TileAssignment> tiles) {
        ClusterOptions options;
        options.servers = servers.addresses;
        options.connectTimeout = test::kPatience;
        return Cluster::connect(options, types, std::move(tiles));
    }
};

TEST_F(ClusterOnLoopback, FramesAreDrawnInStepAndTilesComeBack) {
    Servers servers(types, 3);
    auto cluster = connect(servers, row(4, 300));
    ASSERT_TRUE(cluster) << cluster.error().message;
    Aspect scene(types, ids);
    const auto transform = scene.create<Transform>("wheel");
    const auto geometry = scene.create<Geometry>();
    scene.edit(geometry).assign<&Geometry::positions>(std::vector<glm::vec3>(100'000, glm::vec3(1.0f)));
    const WallViews views = viewsOf(1200, 300);

    auto first = (*cluster)->frame(scene, views, 1.0, true);
    ASSERT_TRUE(first) << first.error().message;
    ASSERT_EQ(first->tiles.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) {
        const TilePixels& tile = first->tiles[i];
        EXPECT_EQ(tile.tile.tile, i);
        ASSERT_EQ(tile.layers.size(), 1u);
        ASSERT_EQ(tile.layers[0].pixels.size(), 300u * 300u * 16u);
        float values[4];
        std::memcpy(values, tile.layers[0].pixels.data(), sizeof(values));
        EXPECT_EQ(values[0], static_cast<float>(i));
        EXPECT_EQ(values[2], 2.0f);
    }
    for (const ServerReport& server : first->servers) {
        EXPECT_GT(server.bytes, 1'200'000u);
        EXPECT_LT(server.bytes, 1'201'500u) << "the blob crosses once";
        EXPECT_GT(server.viewBytes, 0u);
        EXPECT_EQ(server.drawMilliseconds, 1.25);
        EXPECT_EQ(server.digest, first->servers[0].digest);
    }

    auto idle = (*cluster)->frame(scene, views, 1.0, false);
    ASSERT_TRUE(idle) << idle.error().message;
    for (const ServerReport& server : idle->servers) {
        EXPECT_LE(server.bytes, 64u);
        EXPECT_EQ(server.viewBytes, 0u);
    }

    scene.edit(transform).set<&Transform::translation>(glm::dvec3(1, 2, 3));
    auto moved = (*cluster)->frame(scene, views, 1.0, false);
    ASSERT_TRUE(moved) << moved.error().message;
    EXPECT_EQ(moved->entries, 1u);
    EXPECT_LE(moved->changeBytes, 72u);
    EXPECT_EQ(servers.renderer(2).framesDrawn, 3);
    const auto plans = (*cluster)->explain();
    ASSERT_TRUE(plans);
    EXPECT_EQ(plans->at(2), "a fake plan");
}

TEST_F(ClusterOnLoopback, WithLatencyOneTheClientWorksWhileTheServersDraw) {
    Servers servers(types, 1);
    ClusterOptions options;
    options.servers = servers.addresses;
    options.connectTimeout = test::kPatience;
    options.latency = 1;
    auto cluster = Cluster::connect(options, types, row(1, 10));
    ASSERT_TRUE(cluster) << cluster.error().message;
    Aspect scene(types, ids);
    std::promise<void> clientHasWorked;
    servers.renderer(0).whileDrawing = [&, worked = clientHasWorked.get_future().share()] { worked.wait(); };
    auto first = (*cluster)->frame(scene, viewsOf(10, 10), 0.0, true);
    ASSERT_TRUE(first) << first.error().message;
    EXPECT_EQ(first->frame, 0u) << "it is still drawn";
    scene.create<Transform>();
    clientHasWorked.set_value();
    for (std::uint64_t n = 1; n <= 3; ++n) {
        auto report = (*cluster)->frame(scene, viewsOf(10, 10), static_cast<double>(n), true);
        ASSERT_TRUE(report) << report.error().message;
        EXPECT_EQ(report->frame, n) << "the one before";
        EXPECT_EQ(report->tiles.size(), 1u);
    }
    auto last = (*cluster)->finish();
    ASSERT_TRUE(last && *last);
    EXPECT_EQ((*last)->frame, 4u);
    auto none = (*cluster)->finish();
    ASSERT_TRUE(none);
    EXPECT_FALSE(none->has_value());
}

TEST_F(ClusterOnLoopback, ASecondClientStartsFromItsOwnScene) {
    Servers servers(types, 2);
    for (int n = 1; n <= 3; ++n) {
        auto cluster = connect(servers, row(2, 10));
        ASSERT_TRUE(cluster) << cluster.error().message;
        IdSource own;
        Aspect scene(types, own);
        for (int i = 0; i < n; ++i) scene.create<Transform>();
        const auto frame = (*cluster)->frame(scene, viewsOf(20, 10), 0.0, false);
        ASSERT_TRUE(frame) << frame.error().message;
        EXPECT_EQ(servers.renderer(0).containers, static_cast<std::size_t>(n));
    }
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST_F(ClusterOnLoopback, GarbageOnThePortLeavesTheWallUndisturbed) {
    Servers servers(types, 2);
    auto cluster = connect(servers, row(2, 10));
    ASSERT_TRUE(cluster) << cluster.error().message;
    IdSource own;
    Aspect scene(types, own);
    for (int n = 0; n < 20; ++n) {
        const int stranger = ::socket(AF_INET, SOCK_STREAM, 0);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        address.sin_port = htons(servers.addresses[static_cast<std::size_t>(n % 2)].port);
        ASSERT_EQ(::connect(stranger, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
        std::string garbage(static_cast<std::size_t>(n) * 997, static_cast<char>(n * 13));
        ASSERT_EQ(::send(stranger, garbage.data(), garbage.size(), MSG_NOSIGNAL), static_cast<ssize_t>(garbage.size()));
        if (n % 3) ::close(stranger);
        const auto frame = (*cluster)->frame(scene, viewsOf(20, 10), n, true);
        ASSERT_TRUE(frame) << frame.error().message;
        if (n % 3 == 0) ::close(stranger);
    }
}

TEST_F(ClusterOnLoopback, AFrameThatCannotBeDrawnNamesTheServerAndTheReason) {
    Servers servers(types, 2);
    servers.renderer(1).failWith = "the GPU has no memory left";
    auto cluster = connect(servers, row(2, 10));
    ASSERT_TRUE(cluster);
    Aspect scene(types, ids);
    const auto frame = (*cluster)->frame(scene, viewsOf(20, 10), 0.0, false);
    ASSERT_FALSE(frame);
    EXPECT_TRUE(has(frame.error().message, "server1") && has(frame.error().message, "the GPU has no memory left"))
        << frame.error().message;
    EXPECT_FALSE((*cluster)->frame(scene, viewsOf(20, 10), 0.0, false)) << "the cluster has ended";
}

// A write that no edit records, so that the client's state has it and the change list has not; and one that an edit
// does.
void corrupt(Aspect& scene, Ref<Geometry> geometry) {
    auto& container = const_cast<Geometry&>(scene.get(geometry));
    for (const FieldDescriptor& field : container.type().fields) {
        if (field.name != "positions") continue;
        const glm::vec3 wrong(2.0f);
        static_cast<MultiStorage*>(field.address(container))->write(7, std::as_bytes(std::span(&wrong, 1)));
    }
    scene.edit(geometry).setElement<&Geometry::positions>(8, glm::vec3(3.0f));
}

TEST_F(ClusterOnLoopback, AStateThatDiffersIsNamedByContainerAndField) {
    Servers servers(types, 2);
    auto cluster = connect(servers, row(2, 10));
    ASSERT_TRUE(cluster);
    Aspect scene(types, ids);
    for (int i = 0; i < 10; ++i) scene.create<Transform>();
    const auto geometry = scene.create<Geometry>("bumper");
    scene.edit(geometry).assign<&Geometry::positions>(std::vector<glm::vec3>(20, glm::vec3(1.0f)));
    ASSERT_TRUE((*cluster)->frame(scene, viewsOf(20, 10), 0.0, false));
    corrupt(scene, geometry);
    const auto frame = (*cluster)->frame(scene, viewsOf(20, 10), 0.0, false);
    ASSERT_FALSE(frame);
    for (const std::string part : {"frame 2", "'server0'", "Geometry", "'bumper'", "'positions'"})
        EXPECT_TRUE(has(frame.error().message, part)) << frame.error().message;
}

TEST_F(ClusterOnLoopback, UnderDegradeAndStrictADifferenceIsNamedWhileTheWallGoesOn) {
    for (const FailurePolicy policy : {FailurePolicy::Degrade, FailurePolicy::Strict}) {
        Servers servers(types, 2);
        ClusterOptions options;
        options.servers = servers.addresses;
        options.connectTimeout = test::kPatience;
        options.policy = policy;
        auto cluster = Cluster::connect(options, types, row(2, 10));
        ASSERT_TRUE(cluster);
        IdSource own;
        Aspect scene(types, own);
        for (int i = 0; i < 9000; ++i) scene.create<Transform>();  // more than a page of digests
        const auto geometry = scene.create<Geometry>("bumper");
        scene.edit(geometry).assign<&Geometry::positions>(std::vector<glm::vec3>(20, glm::vec3(1.0f)));
        const auto frame = [&] {
            auto done = (*cluster)->frame(scene, viewsOf(20, 10), 0.0, false);
            EXPECT_TRUE(done) << done.error().message;
            return done ? *done : FrameReport();
        };
        frame();
        corrupt(scene, geometry);
        std::vector<std::string> differences;
        std::set<std::string> back;
        EXPECT_TRUE(test::waitUntil([&] {
            const FrameReport report = frame();
            differences.insert(differences.end(), report.differences.begin(), report.differences.end());
            back.insert(report.rejoined.begin(), report.rejoined.end());
            return differences.size() >= 2 && back.size() >= 2;
        }));
        ASSERT_EQ(differences.size(), 2u);
        for (const std::string& text : differences)
            for (const std::string part : {"'server", "Geometry #9001", "'bumper'", "'positions'"})
                EXPECT_TRUE(has(text, part)) << text;
        EXPECT_EQ(back.size(), 2u) << "a snapshot made them whole";
    }
}

TEST_F(ClusterOnLoopback, AServerThatIsNotThereIsNamedInTime) {
    Servers servers(types, 1);
    const test::ReservedPort nobody;
    ClusterOptions options;
    options.servers = {{"right", "127.0.0.1", nobody.number()}, servers.addresses[0]};
    options.connectTimeout = std::chrono::seconds(2);  // enough for a refusal to arrive
    auto cluster = Cluster::connect(options, types, row(2, 10));
    ASSERT_FALSE(cluster);
    EXPECT_EQ(cluster.error().message, "server 'right' at 127.0.0.1:" + std::to_string(nobody.number()) +
                                           " cannot be reached: connection refused; is umbriel-server running there?");
    options.servers = servers.addresses;
    options.servers[0].name = "middle";
    options.connectTimeout = test::kPatience;
    cluster = Cluster::connect(options, types, row(2, 10));
    ASSERT_FALSE(cluster);
    EXPECT_TRUE(has(cluster.error().message, "'server0'") && has(cluster.error().message, "'middle'"))
        << cluster.error().message;
}

}  // namespace
}  // namespace umbriel
