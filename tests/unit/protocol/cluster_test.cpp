#include <gtest/gtest.h>

#include "common/scene/materials.h"
#include "tests/support/framed.h"
#include "tests/support/virtual_wall.h"

namespace umbriel {
namespace {

using namespace std::chrono_literals;
using test::VirtualClient;
using test::VirtualServer;

struct VirtualWall : testing::Test {
    TypeRegistry types;
    net::MemoryNetwork network{{}};
    std::vector<std::unique_ptr<VirtualServer>> servers;
    VirtualWall() { registerCoreTypes(types); }

    VirtualServer& serve(const std::string& name) {
        servers.push_back(std::make_unique<VirtualServer>(name, types, network));
        network.listen(servers.back()->node, name, 7420);
        return *servers.back();
    }
    std::unique_ptr<VirtualClient> reach(const std::vector<std::string>& names, std::uint64_t token = 1) {
        return std::make_unique<VirtualClient>(VirtualClient::options("desk", types, names, token), types, network);
    }
    bool mentions(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }
};

// The property of the whole: whatever the network does to the bytes, every server shows every frame once, in order,
// from the client's state.
struct InStep : testing::TestWithParam<int> {};

TEST_P(InStep, EveryServerShowsEveryFrameFromTheClientsState) {
    const int count = GetParam();
    TypeRegistry types;
    registerCoreTypes(types);
    net::MemoryNetwork network({static_cast<std::uint64_t>(count), 10us, 3ms, true});
    std::vector<std::unique_ptr<VirtualServer>> servers;
    std::vector<std::string> names;
    for (int i = 0; i < count; ++i) {
        names.push_back("s" + std::to_string(i));
        servers.push_back(std::make_unique<VirtualServer>(names.back(), types, network));
        network.listen(servers.back()->node, names.back(), 7420);
    }
    VirtualClient client(VirtualClient::options("desk", types, names), types, network);
    ASSERT_TRUE(client.settle());
    ASSERT_EQ(client.errorText(), "");
    const auto geometry = client.scene.create<Geometry>();
    std::vector<Ref<Transform>> transforms;
    std::vector<std::uint64_t> shown;
    for (int n = 1; n <= 12; ++n) {
        transforms.push_back(client.scene.create<Transform>("t" + std::to_string(n)));
        client.scene.edit(transforms[static_cast<std::size_t>(n / 2)]).set<&Transform::translation>(glm::dvec3(n));
        if (n % 4 == 1)
            client.scene.edit(geometry).assign<&Geometry::positions>(std::vector<glm::vec3>(5000, glm::vec3(float(n))));
        client.begin(n % 3 == 0);
        ASSERT_TRUE(client.settle());
        ASSERT_EQ(client.errorText(), "");
        ASSERT_FALSE(client.client.mismatch());
        shown.push_back(static_cast<std::uint64_t>(n));
        const auto outcome = client.client.takeOutcome();
        network.run(10ms);  // the swap's way
        for (int i = 0; i < count; ++i) {
            EXPECT_EQ(servers[static_cast<std::size_t>(i)]->swapped, shown);
            EXPECT_EQ(servers[static_cast<std::size_t>(i)]->lastDigest, client.digest.total());
            EXPECT_EQ(outcome[static_cast<std::size_t>(i)].tiles.size(), n % 3 == 0 ? 1u : 0u);
            EXPECT_TRUE(servers[static_cast<std::size_t>(i)]->scene.containerCount() == client.scene.containerCount());
        }
    }
    for (const auto& server : servers) EXPECT_EQ(server->blobsReceived, 3u) << "each content crosses once";
}

INSTANTIATE_TEST_SUITE_P(Servers, InStep, testing::Values(1, 2, 3, 5, 8, 16));

TEST_F(VirtualWall, TheSameSeedGivesTheSameBytes) {
    std::uint64_t delivered[2];
    for (auto& bytes : delivered) {
        net::MemoryNetwork again({42, 10us, 3ms, true});
        VirtualServer server("left", types, again);
        again.listen(server.node, "left", 7420);
        VirtualClient client(VirtualClient::options("desk", types, {"left"}), types, again);
        ASSERT_TRUE(client.settle());
        for (int i = 0; i < 5; ++i) {
            client.begin();
            ASSERT_TRUE(client.settle());
        }
        bytes = again.delivered();
    }
    EXPECT_EQ(delivered[0], delivered[1]);
}

TEST_F(VirtualWall, AContentThatReturnsIsNotSentAgain) {
    VirtualServer& server = serve("left");
    const auto client = reach({"left"});
    ASSERT_TRUE(client->settle());
    const auto geometry = client->scene.create<Geometry>();
    for (const float value : {1.0f, 2.0f, 1.0f, 2.0f}) {
        client->scene.edit(geometry).assign<&Geometry::positions>(std::vector<glm::vec3>(10'000, glm::vec3(value)));
        client->begin();
        ASSERT_TRUE(client->settle());
        ASSERT_EQ(client->errorText(), "");
    }
    EXPECT_EQ(server.blobsReceived, 2u);
}

TEST_F(VirtualWall, AnIdleFrameCostsAtMost64BytesAndViewsTravelWhenTheyChange) {
    serve("left");
    const auto client = reach({"left"});
    ASSERT_TRUE(client->settle());
    client->begin();
    ASSERT_TRUE(client->settle());
    EXPECT_GT(client->client.takeOutcome()[0].viewBytes, 0u);
    for (int i = 0; i < 3; ++i) {
        client->begin();
        ASSERT_TRUE(client->settle());
        const auto outcome = client->client.takeOutcome();
        EXPECT_LE(outcome[0].bytes, 64u);
        EXPECT_EQ(outcome[0].viewBytes, 0u);
    }
    client->views.samples = 4;
    client->begin();
    ASSERT_TRUE(client->settle());
    EXPECT_GT(client->client.takeOutcome()[0].viewBytes, 0u);
}

TEST_F(VirtualWall, ALongChangeListTravelsInParts) {
    VirtualServer& server = serve("left");
    const auto client = reach({"left"});
    ASSERT_TRUE(client->settle());
    for (int i = 0; i < 20'000; ++i) client->scene.create<Transform>("a transform with a name " + std::to_string(i));
    client->begin();
    ASSERT_TRUE(client->settle());
    EXPECT_EQ(client->errorText(), "");
    EXPECT_GT(client->client.takeOutcome()[0].bytes, 500'000u);
    EXPECT_EQ(server.scene.containerCount(), 20'000u);
}

TEST_F(VirtualWall, AnotherDigestStopsTheFrameBeforeItIsShownAndCanBeAskedFor) {
    serve("left");
    VirtualServer& liar = serve("right");
    const auto client = reach({"left", "right"});
    ASSERT_TRUE(client->settle());
    const auto transform = client->scene.create<Transform>("wheel");
    liar.corruptDigestBy = 1;
    client->begin();
    ASSERT_TRUE(client->settle());
    ASSERT_TRUE(client->client.mismatch());
    EXPECT_EQ(*client->client.mismatch(), 1u);
    network.run(1s);
    for (const auto& server : servers) EXPECT_TRUE(server->swapped.empty());
    client->client.beginDigestQuery(1, {});
    network.poke(client->client);
    ASSERT_TRUE(client->settle());
    const auto reply = client->client.takeDigests();
    ASSERT_EQ(reply.digests.size(), 1u);
    EXPECT_EQ(reply.digests[0].first, transform.id.value);
    EXPECT_EQ(reply.digests[0].second, client->digest.ofContainer(transform.id));
}

TEST_F(VirtualWall, ASilentServerIsNamedWithinTwoSeconds) {
    serve("left");
    VirtualServer& right = serve("right");
    const auto client = reach({"left", "right"});
    ASSERT_TRUE(client->settle());
    network.run(10s);  // heartbeats alone keep a wall alive
    ASSERT_EQ(client->errorText(), "");
    network.setSilent(right.node, true);
    client->begin();
    const TimePoint start = network.now();
    ASSERT_TRUE(client->settle());
    EXPECT_LE(network.now() - start, 2s);
    EXPECT_TRUE(mentions(client->errorText(), "server 'right' has been silent for 2.0 s")) << client->errorText();
    network.run(2s);
    ASSERT_EQ(right.endings.size(), 1u);  // it noticed, too
    EXPECT_TRUE(mentions(right.endings[0], "client 'desk' has been silent"));
}

TEST_F(VirtualWall, AServerThatDrawsForLongIsWaitedForWhileItsHeartbeatsCome) {
    VirtualServer& left = serve("left");
    const auto client = reach({"left"});
    ASSERT_TRUE(client->settle());
    left.stalled = true;
    client->begin();
    EXPECT_FALSE(client->settle(60s));
    EXPECT_EQ(client->client.waitingFor(), std::vector<std::string>{"server 'left' at left:7420"});
    left.stalled = false;
    EXPECT_TRUE(client->settle(2s));
    EXPECT_EQ(client->errorText(), "");
}

TEST_F(VirtualWall, AFrameTimeoutNamesWhoIsLate) {
    serve("left");
    serve("right").stalled = true;
    auto options = VirtualClient::options("desk", types, {"left", "right"});
    options.frameTimeout = 3s;
    VirtualClient client(options, types, network);
    ASSERT_TRUE(client.settle());
    client.begin();
    const TimePoint start = network.now();
    ASSERT_TRUE(client.settle());
    EXPECT_EQ(network.now() - start, Duration(3s));
    EXPECT_TRUE(mentions(client.errorText(), "still waiting for server 'right'")) << client.errorText();
    EXPECT_FALSE(mentions(client.errorText(), "left")) << client.errorText();
}

TEST_F(VirtualWall, AKilledServerIsNamedAtOnce) {
    serve("left");
    VirtualServer& right = serve("right");
    const auto client = reach({"left", "right"});
    ASSERT_TRUE(client->settle());
    network.remove(right.node);
    const TimePoint start = network.now();
    ASSERT_TRUE(network.runUntil([&] { return client->client.error().has_value(); }, 10s));
    EXPECT_LE(network.now() - start, 10ms);
    EXPECT_TRUE(mentions(client->errorText(), "server 'right' is gone")) << client->errorText();
}

TEST_F(VirtualWall, TheNextClientFindsAnEmptyServer) {
    VirtualServer& left = serve("left");
    {
        const auto client = reach({"left"}, 1);
        ASSERT_TRUE(client->settle());
        for (int i = 0; i < 5; ++i) client->scene.create<Transform>();
        client->begin();
        ASSERT_TRUE(client->settle());
        client->client.leave("done");
        network.poke(client->client);
        ASSERT_TRUE(network.runUntil([&] { return !left.node.hasSession(); }, 1s));
        EXPECT_TRUE(mentions(left.endings.at(0), "client 'desk' has left: done")) << left.endings.at(0);
        network.remove(client->client);
    }
    const auto client = reach({"left"}, 2);
    ASSERT_TRUE(client->settle());
    client->scene.create<Transform>();
    client->begin();
    ASSERT_TRUE(client->settle());
    EXPECT_EQ(client->errorText(), "");
    EXPECT_EQ(left.scene.containerCount(), 1u);
}

TEST_F(VirtualWall, ServersMayDial) {
    auto options = VirtualClient::options("desk", types, {"left", "right"});
    for (auto& server : options.servers) server.host.clear();
    VirtualClient client(options, types, network);
    network.listen(client.client, "desk", 7421);
    for (const std::string name : {"right", "left"}) {
        auto serverOptions = VirtualServer::options(name, types);
        serverOptions.dialHost = "desk";
        serverOptions.dialPort = 7421;
        servers.push_back(std::make_unique<VirtualServer>(serverOptions, types, network));
    }
    ASSERT_TRUE(client.settle());
    ASSERT_EQ(client.errorText(), "");
    client.scene.create<Transform>();
    client.begin(true);
    ASSERT_TRUE(client.settle());
    EXPECT_EQ(client.errorText(), "");
    EXPECT_EQ(client.client.takeOutcome()[0].tiles.size(), 1u);
    EXPECT_EQ(servers[1]->tiles.at(0).tile, 0u) << "'left' has the first tile although 'right' dialled first";
}

TEST_F(VirtualWall, AJobIsOfferedOverTheControlConnection) {
    // The server's half is held to its messages; the client's is used in tests/sim/bake_sim_test.cpp.
    VirtualServer& left = serve("left");
    auto stranger = network.dial("left", 7420);
    wire::Hello hello = test::identityOf("baker", types);
    hello.token = {7, 7};
    hello.epoch = 1;
    stranger.send(test::framed(hello, 0, 0));
    stranger.send(test::framed(wire::Welcome{}, 1, 1));
    stranger.send(test::framed(wire::JobOffer{5, 1, 2000, "bake", std::as_bytes(std::span("abc", 3)), {}}, 1, 2));
    network.run(10ms);
    ASSERT_EQ(left.jobs.size(), 1u);
    EXPECT_EQ(left.jobs[0].kind, "bake");
    EXPECT_EQ(left.jobs[0].lease, Duration(2s));
    left.node.sendJobDone({5, 1, wire::JobStatus::Done, "", {}, 0, 0}, wire::Bytes(1000, std::byte{1}));
    network.poke(left.node);
    network.run(10ms);
    EXPECT_FALSE(stranger.isClosed());
    EXPECT_EQ(test::heard(stranger.answer()).types.back(), wire::MessageType::JobDone);
    // A result that was let go of is not there any more.
    MultiStorage content(1);
    content.resize(1000);
    content.write(0, wire::Bytes(1000, std::byte{1}));
    stranger.send(test::framed(wire::JobCancel{5, 1}, 1, 3));
    stranger.send(test::framed(wire::BlobWanted{{wire::hashOfBlob(content)}}, 1, 4));
    network.run(10ms);
    EXPECT_TRUE(stranger.isClosed());
}

TEST_F(VirtualWall, JobsRunBesideFramesAndTheirResultsAreFetched) {
    VirtualServer& left = serve("left");
    const auto desk = reach({"left"});
    ASSERT_TRUE(desk->settle());
    protocol::ClusterClient& client = desk->client;
    wire::Blob content{{}, MultiStorage(4)};
    content.data.resize(100'000);
    content.ref = {wire::hashOfBlob(content.data), 4, 400'000};
    client.provideBlobs({content});
    auto news = client.takeJobNews();
    ASSERT_EQ(news.size(), 1u);
    EXPECT_EQ(news[0].kind, protocol::JobNews::Kind::Begun);
    EXPECT_EQ(news[0].text, "left");
    const protocol::JobPeer peer = news[0].peer;
    client.offerJob({0, peer.session + 1}, {8, 1, 2s, "bake", {}, {}});  // of no session
    client.offerJob(peer, {9, 1, 2s, "bake", {}, {content.ref}});
    network.poke(client);
    network.run(10ms);
    ASSERT_EQ(left.jobs.size(), 1u);
    EXPECT_EQ(left.jobs[0].job, 9u);
    ASSERT_EQ(left.jobs[0].blobs, std::vector{content.ref});
    left.node.wantBlobs(left.jobs[0].blobs);
    left.node.sendJobLease({9, 1, 0.5f});
    left.node.sendJobDone({9, 1, wire::JobStatus::Done, "", {}, 0, 77}, wire::Bytes(600'000, std::byte{3}));
    network.poke(left.node);
    network.run(50ms);
    EXPECT_EQ(left.blobsReceived, 1u);
    news = client.takeJobNews();
    ASSERT_EQ(news.size(), 2u);
    EXPECT_EQ(news[0].lease.progress, 0.5f);
    EXPECT_EQ(news[1].done.cpuMicroseconds, 77u);
    client.fetchResult(peer, {news[1].done.result, 1, news[1].done.resultBytes});
    desk->scene.create<Transform>();
    desk->begin();
    ASSERT_TRUE(desk->settle());
    network.run(50ms);
    news = client.takeJobNews();
    ASSERT_EQ(news.size(), 1u);
    EXPECT_EQ(news[0].kind, protocol::JobNews::Kind::Result);
    EXPECT_EQ(news[0].result.data.byteSize(), 600'000u);
    EXPECT_FALSE(client.error());
}

}  // namespace
}  // namespace umbriel
