#include <gtest/gtest.h>

#include "common/scene/nodes.h"
#include "tests/support/virtual_wall.h"

namespace umbriel {
namespace {

using namespace std::chrono_literals;
using protocol::FailurePolicy;
using protocol::FrameHistory;
using protocol::FramePacing;
using protocol::ServerIncident;
using test::VirtualClient;
using test::VirtualServer;

// A wall of two servers under a policy.
struct Policies : testing::Test {
    TypeRegistry types;
    net::MemoryNetwork network{{}};
    std::vector<std::unique_ptr<VirtualServer>> servers;
    std::unique_ptr<VirtualClient> client;
    Ref<Transform> wheel;
    Policies() { registerCoreTypes(types); }

    VirtualServer& serve(const std::string& name, Duration clientLoss = 2s) {
        auto options = VirtualServer::options(name, types);
        options.link.heartbeatLoss = clientLoss;
        servers.push_back(std::make_unique<VirtualServer>(std::move(options), types, network));
        network.listen(servers.back()->node, name, 7420);
        return *servers.back();
    }
    void reach(FailurePolicy policy, int latency = 0) {
        auto options = VirtualClient::options("desk", types, {"left", "right"});
        options.policy = policy;
        options.latency = latency;
        reach(options);
    }
    void reach(const protocol::ClusterClientOptions& options) {
        client = std::make_unique<VirtualClient>(options, types, network);
        ASSERT_TRUE(client->settle());
        ASSERT_EQ(client->errorText(), "");
        wheel = client->scene.create<Transform>("wheel");
        for (int i = 0; i < 3; ++i) draw();
    }
    // One frame with a change; how long it held the application up.
    Duration draw() {
        client->scene.edit(wheel).set<&Transform::translation>(glm::dvec3(static_cast<double>(client->frame)));
        const TimePoint start = network.now();
        client->begin();
        EXPECT_TRUE(client->settle());
        EXPECT_EQ(client->errorText(), "");
        const Duration took = network.now() - start;
        network.run(10ms);
        return took;
    }
    void drawFor(Duration time) {
        for (const TimePoint end = network.now() + time; network.now() < end;) draw();
    }
    std::vector<ServerIncident::Kind> incidents() {
        std::vector<ServerIncident::Kind> kinds;
        for (const auto& incident : client->client.takeIncidents()) kinds.push_back(incident.kind);
        return kinds;
    }
    void expectInStep() {
        for (const VirtualServer* server : {servers.front().get(), servers.back().get()}) {
            EXPECT_EQ(server->swapped.back(), client->frame);
            EXPECT_EQ(server->lastDigest, client->digest.total());
        }
    }
};

TEST_F(Policies, UnderDegradeALateServerHoldsTheWallUpOnceAndComesBackWithWhatItMissed) {
    serve("left");
    VirtualServer& right = serve("right");
    reach(FailurePolicy::Degrade);
    right.stalled = true;
    const std::uint64_t before = right.swapped.back();
    const Duration first = draw();
    EXPECT_GE(first, FramePacing::kDegradeLeast);
    EXPECT_LE(first, FramePacing::kDegradeMost);
    EXPECT_EQ(incidents(), std::vector{ServerIncident::Kind::Late});
    const auto outcome = client->client.takeOutcome();
    EXPECT_TRUE(outcome[0].shown);
    EXPECT_TRUE(outcome[1].connected);
    EXPECT_FALSE(outcome[1].shown);
    for (int i = 0; i < 20; ++i) EXPECT_LT(draw(), 5ms) << "it is not waited for again";
    EXPECT_EQ(right.swapped.back(), before) << "its tile holds its last picture";
    EXPECT_FALSE(client->client.isWhole());
    right.stalled = false;
    network.poke(right.node);
    draw();
    draw();
    EXPECT_TRUE(client->client.isWhole());
    EXPECT_EQ(incidents(), std::vector{ServerIncident::Kind::Rejoined});
    EXPECT_EQ(client->snapshots, 0) << "what it missed is enough";
    EXPECT_EQ(right.clients.size(), 1u) << "its session went on";
    expectInStep();
}

TEST_F(Policies, UnderStrictTheWallWaitsTwoSecondsAtMost) {
    serve("left");
    VirtualServer& right = serve("right");
    reach(FailurePolicy::Strict);
    right.stalled = true;
    const Duration waited = draw();
    EXPECT_GE(waited, 2s);
    EXPECT_LE(waited, 2001ms);
    EXPECT_EQ(incidents(), std::vector{ServerIncident::Kind::Late});
}

TEST_F(Policies, AServerFurtherBehindThanTheHistoryGetsASnapshotInItsSession) {
    serve("left");
    VirtualServer& right = serve("right");
    auto options = VirtualClient::options("desk", types, {"left", "right"});
    options.policy = FailurePolicy::Degrade;
    options.historyFrames = 4;
    reach(options);
    right.stalled = true;
    for (int i = 0; i < 10; ++i) draw();
    EXPECT_EQ(client->snapshots, 0);
    right.stalled = false;
    network.poke(right.node);
    for (int i = 0; i < 4; ++i) draw();
    EXPECT_EQ(client->snapshots, 1);
    EXPECT_EQ(right.clients.size(), 1u);
    EXPECT_TRUE(client->client.isWhole());
    expectInStep();
}

TEST_F(Policies, AKilledServerRejoinsFromASnapshotWhileTheOthersDraw) {
    serve("left");
    VirtualServer& right = serve("right");
    reach(FailurePolicy::Strict);
    network.remove(right.node);
    network.run(1ms);
    for (int i = 0; i < 30; ++i) EXPECT_LT(draw(), 5ms);
    EXPECT_EQ(incidents().front(), ServerIncident::Kind::Lost);
    serve("right");
    const TimePoint back = network.now();
    while (!client->client.isWhole() && network.now() < back + 5s) EXPECT_LT(draw(), 5ms);
    EXPECT_LE(network.now() - back, 2s);
    EXPECT_EQ(client->snapshots, 1);
    draw();
    expectInStep();
}

TEST_F(Policies, ASilentServerIsDroppedAndIsWholeTwoSecondsAfterItsReturn) {
    serve("left");
    VirtualServer& right = serve("right");
    reach(FailurePolicy::Degrade);
    network.setSilent(right.node, true);
    drawFor(6s);
    network.setSilent(right.node, false);
    const TimePoint back = network.now();
    while (!client->client.isWhole() && network.now() < back + 5s) draw();
    EXPECT_LE(network.now() - back, 2s);
    draw();
    expectInStep();
}

TEST_F(Policies, AServerWithAnotherStateShowsNothingOfItAndGetsASnapshot) {
    serve("left");
    VirtualServer& right = serve("right");
    reach(FailurePolicy::Degrade);
    const std::uint64_t before = right.swapped.back();
    right.corruptDigestBy = 1;
    draw();
    EXPECT_EQ(right.swapped.back(), before);
    right.corruptDigestBy = 0;
    for (int i = 0; i < 3; ++i) draw();
    EXPECT_EQ(incidents(), (std::vector{ServerIncident::Kind::Differing, ServerIncident::Kind::Rejoined}));
    EXPECT_EQ(client->snapshots, 1);
    expectInStep();
}

TEST_F(Policies, AWallMayStartWithoutAServerThatJoinsLater) {
    serve("left");
    auto options = VirtualClient::options("desk", types, {"left", "right"});
    options.policy = FailurePolicy::Degrade;
    options.startIncomplete = true;
    reach(options);
    EXPECT_EQ(incidents().front(), ServerIncident::Kind::Lost);
    serve("right");
    drawFor(1500ms);
    EXPECT_TRUE(client->client.isWhole());
    draw();
    expectInStep();
}

TEST_F(Policies, AClientThatWasStoppedForSecondsLosesNobody) {
    serve("left", 10s);
    serve("right", 10s);
    reach(FailurePolicy::Degrade);
    for (const auto time : {1900ms, 3000ms, 9000ms}) {
        network.setPaused(client->client, true);
        network.run(time);  // their heartbeats lie in its sockets
        network.setPaused(client->client, false);
        drawFor(2500ms);
        EXPECT_EQ(incidents(), std::vector<ServerIncident::Kind>());
        expectInStep();
    }
}

TEST_F(Policies, AClientThatIsSilentGivesWayToAnotherOne) {
    VirtualServer& left = serve("left", 10s);
    auto options = VirtualClient::options("desk", types, {"left"});
    reach(options);
    network.setPaused(client->client, true);
    network.run(1500ms);
    auto others = VirtualClient::options("guest", types, {"left"});
    others.token = {77, 78};
    others.connectTimeout = 200ms;
    VirtualClient early(others, types, network);
    EXPECT_TRUE(early.settle());
    EXPECT_NE(early.errorText().find("busy with client 'desk'"), std::string::npos) << early.errorText();
    network.run(1000ms);
    VirtualClient guest(others, types, network);
    EXPECT_TRUE(guest.settle());
    EXPECT_EQ(guest.errorText(), "");
    EXPECT_EQ(left.clients, (std::vector<std::string>{"desk", "guest"}));
    ASSERT_EQ(left.endings.size(), 1u);
    EXPECT_NE(left.endings[0].find("the client was silent, and 'guest' has come"), std::string::npos);
}

// A wall whose network has a window, so that a sender learns that nobody reads.
struct BulkConnections : Policies {
    static constexpr std::size_t kWindow = 64 * 1024;
    static constexpr std::size_t kSceneBytes = 3'000'000;
    BulkConnections() { network = net::MemoryNetwork({.window = kWindow}); }
    // A large content is new in the scene.
    void load() {
        const auto geometry = client->scene.create<Geometry>();
        std::vector<glm::vec3> positions(kSceneBytes / 12);
        for (std::size_t i = 0; i < positions.size(); ++i) positions[i] = glm::vec3(static_cast<float>(i));
        client->scene.edit(geometry).assign<&Geometry::positions>(positions);
    }
    std::size_t mostQueued = 0;
    // A few frames a second: what is shown here is about seconds, and frames cost the time of this test.
    void drawFor(Duration time, Duration longest) {
        for (const TimePoint end = network.now() + time; network.now() < end;) {
            EXPECT_LT(draw(), longest);
            mostQueued = std::max(mostQueued, network.queued(client->client));
            network.run(50ms);
        }
    }
};

TEST_F(BulkConnections, AServerThatReadsNoBulkIsLateThenLostAndNeverCostsMemory) {
    VirtualServer& left = serve("left");
    VirtualServer& right = serve("right");
    reach(FailurePolicy::Degrade);
    network.setPace(right.node, 1, 0);
    load();
    const TimePoint start = network.now();
    EXPECT_LE(draw(), 1s) << "the other one fetches the content, this one is late once";
    drawFor(4s, 10ms);
    EXPECT_EQ(left.swapped.back(), client->frame) << "the others are undisturbed";
    EXPECT_EQ(incidents(), std::vector{ServerIncident::Kind::Late});
    EXPECT_LE(mostQueued, std::size_t{2} << 20) << "contents are not copied into queues";
    for (;;) {
        draw();
        const auto seen = client->client.takeIncidents();
        if (!seen.empty()) {
            EXPECT_EQ(seen[0].kind, ServerIncident::Kind::Lost);
            EXPECT_NE(seen[0].text.find("server 'right' has read nothing of its bulk connection for 5.0 s"),
                      std::string::npos)
                << seen[0].text;
            break;
        }
        ASSERT_LT(network.now() - start, 8s);
    }
    drawFor(3s, 1s);
    EXPECT_TRUE(client->client.isWhole()) << "with new connections it gets a snapshot";
    expectInStep();
}

TEST_F(BulkConnections, AServerThatReadsSlowlyForEverIsNotWaitedForAndKeepsItsSession) {
    VirtualServer& left = serve("left");
    VirtualServer& right = serve("right");
    reach(FailurePolicy::Degrade);
    network.setPace(right.node, 1, 20'000);
    load();
    EXPECT_LE(draw(), 1s);
    drawFor(10s, 10ms);
    EXPECT_EQ(left.swapped.back(), client->frame);
    EXPECT_EQ(incidents(), std::vector{ServerIncident::Kind::Late}) << "said once";
    EXPECT_EQ(right.clients.size(), 1u);
    EXPECT_LE(mostQueued, std::size_t{2} << 20);
    EXPECT_LE(client->client.historyBytes(), std::uint64_t{64} << 20);
    network.setPace(right.node, 1, 100'000'000);
    drawFor(6s, 1s);  // what was under way takes its time
    EXPECT_TRUE(client->client.isWhole());
}

TEST_F(BulkConnections, PixelsThatTrickleInForEverHoldTheWallUpOnce) {
    serve("left");
    VirtualServer& right = serve("right");
    reach(FailurePolicy::Degrade);
    network.setPace(right.node, 1, 4'000);  // a tile takes 0.4 s
    int longFrames = 0;
    for (int i = 0; i < 300; ++i) {
        client->scene.edit(wheel).set<&Transform::translation>(glm::dvec3(i));
        const TimePoint start = network.now();
        client->begin(true);
        ASSERT_TRUE(client->settle());
        longFrames += network.now() - start > 20ms;
        EXPECT_EQ(client->client.takeOutcome()[0].tiles.size(), 1u) << "the others' pixels are there";
        network.run(10ms);
    }
    EXPECT_EQ(longFrames, 1);
    EXPECT_EQ(incidents(), std::vector{ServerIncident::Kind::Late});
    network.setPace(right.node, 1, 100'000'000);
    std::size_t tiles = 0;
    for (int i = 0; i < 6000 && tiles == 0; ++i) {  // what was under way takes its time
        client->begin(true);
        ASSERT_TRUE(client->settle());
        tiles = client->client.takeOutcome()[1].tiles.size();
        network.run(10ms);
    }
    EXPECT_EQ(tiles, 1u) << "it is waited for again";
    EXPECT_TRUE(client->client.isWhole());
}

TEST(BlobReceiver, TakesOneBlobAfterTheOther) {
    const wire::Bytes content(100'000, std::byte{7});
    MultiStorage data(1);
    data.resize(content.size());
    data.write(0, content);
    const wire::BlobRef one{wire::hashOfBlob(data), 1, content.size()};
    const wire::BlobRef other{{1, 2}, 1, content.size()};
    protocol::BlobReceiver receiver;
    EXPECT_TRUE(receiver.expect(one));
    EXPECT_TRUE(receiver.expect(other));
    const auto part = [&](const wire::BlobRef& of, std::size_t offset, std::size_t count) {
        return receiver.part({of.hash, of.bytes, offset, std::span(content).subspan(offset, count)});
    };
    EXPECT_TRUE(part(one, 0, 60'000));
    EXPECT_FALSE(part(other, 0, 1)) << "each that has begun takes memory ahead of what came";
    const auto whole = part(one, 60'000, 40'000);
    ASSERT_TRUE(whole && *whole);
    EXPECT_EQ((*whole)->ref, one);
    EXPECT_TRUE(part(other, 0, 1));
}

TEST(BulkSender, TilesOfFramesThatWereGivenUpDoNotPileUp) {
    protocol::BulkSender sender;
    for (std::uint64_t frame = 1; frame <= 1000; ++frame)
        sender.addTile(frame, {{0, {0, 0, 4, 4}, Eye::Mono},
                               {{Layer::Colour, "colour", 4, ComponentType::Float, wire::Bytes(256)}}});
    EXPECT_LE(sender.size(), 3u);
}

TEST_F(Policies, WithLatencyOneARequestIsOverWhenTheFrameBeforeIs) {
    serve("left");
    VirtualServer& right = serve("right");
    reach(FailurePolicy::Wait, 1);
    client->client.finishFrames();
    ASSERT_TRUE(client->settle());
    client->client.takeFinished();
    right.stalled = true;
    client->begin();
    EXPECT_FALSE(client->client.isBusy()) << "the client may prepare the next frame";
    client->begin();
    EXPECT_TRUE(client->client.isBusy());
    EXPECT_FALSE(client->settle(1s));
    right.stalled = false;
    network.poke(right.node);
    EXPECT_TRUE(client->settle());
    client->client.finishFrames();
    EXPECT_TRUE(client->settle());
    network.run(10ms);
    const auto finished = client->client.takeFinished();
    ASSERT_EQ(finished.size(), 2u);
    EXPECT_EQ(finished[0].number + 1, finished[1].number);
    EXPECT_EQ(servers[0]->swapped, right.swapped) << "every frame is shown, in order";
    EXPECT_EQ(right.swapped.back(), client->frame);
}

TEST(FramePacing, ItsAllowanceIsThreeMedianFramesWithinBounds) {
    FramePacing pacing(FailurePolicy::Degrade);
    EXPECT_EQ(*pacing.allowance(), FramePacing::kDegradeMost) << "nothing is known yet";
    for (int i = 0; i < 31; ++i) pacing.took(1ms);
    EXPECT_EQ(*pacing.allowance(), FramePacing::kDegradeLeast);
    for (int i = 0; i < 15; ++i) pacing.took(5s);
    EXPECT_EQ(*pacing.allowance(), FramePacing::kDegradeLeast) << "a few slow frames are not the median";
    for (int i = 0; i < 31; ++i) pacing.took(50ms);
    EXPECT_EQ(*pacing.allowance(), Duration(150ms));
    EXPECT_FALSE(FramePacing(FailurePolicy::Wait).allowance());
}

TEST(FrameHistory, KeepsWhatItsLimitsAllowAndKnowsWhatIsMissing) {
    const auto frame = [](std::uint64_t number) { return protocol::packChanges(number, {wire::Bytes(100)}, {}); };
    FrameHistory history(450, 10);
    history.restart(1);
    for (std::uint64_t n = 2; n <= 6; ++n) history.add(frame(n));
    EXPECT_EQ(history.frames(), 4u);
    EXPECT_EQ(history.bytes(), 400u);
    EXPECT_EQ(history.since(6)->size(), 0u);
    ASSERT_EQ(history.since(4)->size(), 2u);
    EXPECT_EQ(history.since(4)->front()->number, 5u);
    EXPECT_EQ(history.since(2)->size(), 4u);
    EXPECT_FALSE(history.since(1)) << "frame 2 was given up";
    history.forget(5);
    EXPECT_EQ(history.since(5)->size(), 1u);
    EXPECT_FALSE(history.since(4));
}

}  // namespace
}  // namespace umbriel
