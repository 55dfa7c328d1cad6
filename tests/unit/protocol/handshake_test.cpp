#include "common/protocol/handshake.h"

#include <gtest/gtest.h>

#include "tests/support/framed.h"
#include "tests/support/virtual_wall.h"

namespace umbriel {
namespace {

using namespace std::chrono_literals;
using test::framed;
using test::VirtualClient;
using test::VirtualServer;
using wire::MessageType;

struct CoreTypes {
    TypeRegistry types;
    CoreTypes() { registerCoreTypes(types); }
};

struct Handshake : CoreTypes, testing::Test {
    net::MemoryNetwork network{{}};
    VirtualServer left{"left", types, network};
    Handshake() { network.listen(left.node, "left", 7420); }

    wire::Hello hello(std::uint64_t token = 9, std::uint32_t epoch = 1) {
        wire::Hello hello = test::identityOf("stranger", types);
        hello.token = {token, token};
        hello.epoch = epoch;
        return hello;
    }
    // What a server answers to these bytes.
    test::Heard answerTo(const wire::Bytes& bytes, Duration time = 10ms) {
        auto stranger = network.dial("left", 7420);
        stranger.send(bytes);
        network.run(time);
        EXPECT_TRUE(stranger.isClosed());
        return test::heard(stranger.answer());
    }
    std::string connectError(protocol::ClusterClientOptions options) {
        VirtualClient client(options, types, network);
        EXPECT_TRUE(client.settle());
        network.run(10ms);
        const std::string text = client.errorText();
        network.remove(client.client);
        return text;
    }
};

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST_F(Handshake, AMismatchIsRefusedInWordsThatNameBothValues) {
    wire::Hello other = hello();
    other.version = 77;
    auto answer = answerTo(framed(other, 0, 0));
    EXPECT_EQ(answer.types, (std::vector{MessageType::Hello, MessageType::Refuse}));
    EXPECT_TRUE(has(answer.lastText, "version 77") && has(answer.lastText, "version 1 ")) << answer.lastText;

    other = hello();
    other.typeSignature ^= 1;
    answer = answerTo(framed(other, 0, 0));
    EXPECT_TRUE(has(answer.lastText, toHex(types.signature())) && has(answer.lastText, toHex(types.signature() ^ 1)))
        << answer.lastText;

    other = hello();
    other.wantedName = "right";
    answer = answerTo(framed(other, 0, 0));
    EXPECT_TRUE(has(answer.lastText, "'left'") && has(answer.lastText, "'right'")) << answer.lastText;

    other = hello();
    other.role = wire::Role::Server;
    answer = answerTo(framed(other, 0, 0));
    EXPECT_TRUE(has(answer.lastText, "both sides are servers")) << answer.lastText;
    EXPECT_TRUE(left.clients.empty());
}

TEST_F(Handshake, TheClientSaysWhatIsWrongToo) {
    auto options = VirtualClient::options("desk", types, {"left"});
    options.servers[0].name = "right";
    std::string text = connectError(options);
    EXPECT_TRUE(has(text, "'left'") && has(text, "'right'") && has(text, "left:7420")) << text;

    options = VirtualClient::options("desk", types, {"left"});
    options.identity.typeSignature ^= 1;
    text = connectError(options);
    EXPECT_TRUE(has(text, "scene types")) << text;

    options = VirtualClient::options("desk", types, {"left"});
    options.identity.version = 2;
    text = connectError(options);
    EXPECT_TRUE(has(text, "version 2") && has(text, "version 1")) << text;
}

TEST_F(Handshake, WhatOnePartnerNeedsTheOtherMustBeAbleToDo) {
    auto options = VirtualClient::options("desk", types, {"left"});
    options.identity.needs = wire::kReturnsPixels | wire::kWorksOnJobs | std::uint64_t{1} << 40;
    const std::string text = connectError(options);
    EXPECT_TRUE(has(text, "server 'left' (build test) cannot do what client 'desk' needs: pixels, jobs, capability 40"))
        << text;

    wire::Hello able = hello();
    able.capabilities = ~std::uint64_t{0};  // of a later build: what nobody needs does not matter
    auto stranger = network.dial("left", 7420);
    stranger.send(framed(able, 0, 0));
    network.run(10ms);
    EXPECT_EQ(test::heard(stranger.answer()).types.back(), MessageType::Welcome);
    stranger.close();
    network.run(10ms);

    auto needy = VirtualServer::options("needy", types);
    needy.identity.needs = wire::kReportsSwaps;
    VirtualServer server(needy, types, network);
    network.listen(server.node, "needy", 7420);
    const std::string other = connectError(VirtualClient::options("desk", types, {"needy"}));
    EXPECT_TRUE(has(other, "client 'desk' (build test) cannot do what server 'needy' needs: swap times")) << other;
}

TEST_F(Handshake, LimitsAreStatedAndKept) {
    wire::Hello small = hello();
    small.maxBlobBytes = 1000;
    const auto answer = answerTo(framed(small, 0, 0));
    EXPECT_TRUE(has(answer.lastText, "client 'stranger' takes 1000 bytes of a blob, at least 1048576 are needed"))
        << answer.lastText;

    auto limited = VirtualServer::options("limited", types);
    limited.identity.maxBlobBytes = 1 << 20;
    limited.identity.maxChangeBytes = 2 << 20;
    VirtualServer server(limited, types, network);
    network.listen(server.node, "limited", 7420);
    for (const std::size_t vertices : {80'000u, 100'000u}) {
        VirtualClient client(VirtualClient::options("desk", types, {"limited"}), types, network);
        ASSERT_TRUE(client.settle());
        const auto geometry = client.scene.create<Geometry>();
        client.scene.edit(geometry).assign<&Geometry::positions>(std::vector<glm::vec3>(vertices, glm::vec3(1.0f)));
        client.begin();
        ASSERT_TRUE(client.settle());
        EXPECT_EQ(client.errorText(), vertices == 80'000u
                                          ? ""
                                          : "server 'limited' at limited:7420 takes blobs of 1048576 bytes, the scene "
                                            "has one of 1200000");
        network.remove(client.client);
        network.run(10ms);
    }
}

// A client that servers dial.
struct DialledClient : Handshake {
    protocol::ClusterClientOptions options = VirtualClient::options("desk", types, {"one", "two"});
    std::optional<VirtualClient> client;
    DialledClient() {
        for (auto& server : options.servers) server.host.clear();
    }
    void start() {
        client.emplace(options, types, network);
        network.listen(client->client, "desk", 7421);
    }
    std::unique_ptr<VirtualServer> server(const std::string& name) {
        auto server = VirtualServer::options(name, types);
        server.dialHost = "desk";
        server.dialPort = 7421;
        return std::make_unique<VirtualServer>(server, types, network);
    }
    test::Heard clientsAnswerTo(const wire::Bytes& bytes) {
        auto stranger = network.dial("desk", 7421);
        stranger.send(bytes);
        network.run(10ms);
        EXPECT_TRUE(stranger.isClosed());
        return test::heard(stranger.answer());
    }
    bool draws() {
        client->begin();
        return client->settle() && client->errorText().empty();
    }
    wire::Hello serverHello(const std::string& name) {
        wire::Hello hello = test::identityOf(name, types);
        hello.role = wire::Role::Server;
        return hello;
    }
};

TEST_F(DialledClient, TakesServersByTheirNames) {
    start();
    const auto two = server("two");
    network.run(1s);
    EXPECT_TRUE(client->client.isBusy()) << "it waits for the other";
    const auto one = server("one");
    ASSERT_TRUE(client->settle());
    ASSERT_TRUE(draws());
    EXPECT_EQ(one->tiles[0].tile, 0u);
    EXPECT_EQ(two->tiles[0].tile, 1u);
    const auto twin = server("one");
    const auto stranger = server("three");
    network.run(2s);
    EXPECT_TRUE(twin->clients.empty() && stranger->clients.empty());
    ASSERT_EQ(twin->unreachable.size(), 1u) << "said once, however often it dials";
    EXPECT_TRUE(has(twin->unreachable[0], "client 'desk' has a server 'one' already")) << twin->unreachable[0];
    EXPECT_TRUE(has(stranger->unreachable[0], "client 'desk' does not wait for a server 'three'"))
        << stranger->unreachable[0];
    EXPECT_TRUE(draws());
}

TEST_F(DialledClient, GivesAServerThatComesBackItsPlace) {
    for (auto& server : options.servers) server.name.clear();
    options.policy = protocol::FailurePolicy::Degrade;
    start();
    auto a = server("a");
    network.run(100ms);
    auto b = server("b");
    ASSERT_TRUE(client->settle());
    ASSERT_TRUE(draws());
    EXPECT_EQ(a->tiles[0].tile, 0u);
    network.remove(a->node);
    network.remove(b->node);
    for (int i = 0; i < 5; ++i) ASSERT_TRUE(draws());
    b = server("b");
    a = server("a");
    const TimePoint back = network.now();
    while (!client->client.isWhole() && network.now() - back < 2s) ASSERT_TRUE(draws());
    EXPECT_TRUE(client->client.isWhole());
    EXPECT_EQ(a->tiles[0].tile, 0u);
    EXPECT_EQ(b->tiles[0].tile, 1u);
}

TEST_F(DialledClient, RefusesWhatDoesNotFitAndGoesOn) {
    start();
    const auto one = server("one"), two = server("two");
    ASSERT_TRUE(client->settle());
    wire::Hello other = serverHello("one");
    other.version = 77;
    EXPECT_TRUE(has(clientsAnswerTo(framed(other, 0, 0)).lastText, "version 77"));
    other = serverHello("one");
    other.typeSignature ^= 1;
    EXPECT_TRUE(has(clientsAnswerTo(framed(other, 0, 0)).lastText, "scene types"));
    other = serverHello("one");
    other.channel = wire::Channel::Bulk;
    other.token = {4, 4};
    EXPECT_TRUE(has(clientsAnswerTo(framed(other, 0, 0)).lastText, "no session that this bulk connection belongs to"));
    other.role = wire::Role::Client;
    EXPECT_TRUE(has(clientsAnswerTo(framed(other, 0, 0)).lastText, "both sides are clients"));
    wire::Bytes tooLong(wire::kHeaderBytes);
    wire::encodeHeader({5000, 1, 0, 0}, std::span(tooLong).first<wire::kHeaderBytes>());
    EXPECT_TRUE(has(clientsAnswerTo(tooLong).lastText, "5000 bytes"));
    EXPECT_TRUE(has(clientsAnswerTo(framed(wire::Ready{}, 0, 0)).lastText, "first message is not a hello"));
    EXPECT_TRUE(draws());
}

TEST_F(DialledClient, KeepsOnlySoManyStrangers) {
    start();
    const auto one = server("one"), two = server("two");
    ASSERT_TRUE(client->settle());
    std::vector<net::MemoryNetwork::Stranger> strangers;
    for (int i = 0; i < 100; ++i) strangers.push_back(network.dial("desk", 7421));
    network.run(10ms);
    const auto open =
        std::count_if(strangers.begin(), strangers.end(), [](const auto& one) { return !one.isClosed(); });
    EXPECT_GT(open, 0);
    EXPECT_LE(open, 4 * 2 + 17);
    EXPECT_TRUE(draws());
    network.run(5100ms);
    for (const auto& stranger : strangers) EXPECT_TRUE(stranger.isClosed()) << "a handshake has 5 s";
}

// Silent connections take places, yet who says hello gets one: at the server that a client dials (both its connections),
// and at the client that servers dial. Meanwhile more strangers come.
TEST_F(Handshake, SilentStrangersKeepNobodyOutOfAServer) {
    std::vector<net::MemoryNetwork::Stranger> strangers;
    const auto flood = [&](int count) {
        for (int i = 0; i < count; ++i) strangers.push_back(network.dial("left", 7420));
        network.run(1ms);
    };
    flood(100);
    const auto open = [&] {
        return std::count_if(strangers.begin(), strangers.end(), [](const auto& one) { return !one.isClosed(); });
    };
    EXPECT_EQ(open(), 64);
    VirtualClient client(VirtualClient::options("desk", types, {"left"}), types, network);
    ASSERT_TRUE(client.settle());
    EXPECT_EQ(client.errorText(), "");
    EXPECT_EQ(left.clients, std::vector<std::string>{"desk"});
    flood(100);
    client.begin();
    ASSERT_TRUE(client.settle());
    EXPECT_EQ(client.errorText(), "");
    EXPECT_LE(open(), 62) << "the session keeps its two places";
}

TEST_F(DialledClient, SilentStrangersKeepNoServerOut) {
    start();
    std::vector<net::MemoryNetwork::Stranger> strangers;
    for (int i = 0; i < 60; ++i) strangers.push_back(network.dial("desk", 7421));
    network.run(10ms);
    const auto one = server("one"), two = server("two");
    ASSERT_TRUE(client->settle());
    EXPECT_EQ(client->errorText(), "");
    EXPECT_TRUE(draws());
}

// Takes calls and says nothing.
class Mute final : public protocol::Endpoint {
 public:
    void opened(protocol::ConnectionId, std::uint64_t, TimePoint) override {}
    void dialFailed(std::uint64_t, const Error&, TimePoint) override {}
    void received(protocol::ConnectionId, std::span<const std::byte>, TimePoint) override {}
    void written(protocol::ConnectionId, TimePoint) override {}
    void closed(protocol::ConnectionId, const std::string&, TimePoint) override {}
    void advance(TimePoint) override {}
    TimePoint deadline() const override { return TimePoint::max(); }
    std::optional<protocol::Action> nextAction() override { return std::nullopt; }
    protocol::SendQueue* output(protocol::ConnectionId) override { return nullptr; }
    std::optional<protocol::ConnectionId> nextOutput() override { return std::nullopt; }
};

TEST_F(Handshake, WhoSaysNoHelloIsNamedByTheAddressThatWasDialled) {
    Mute mute;
    network.listen(mute, "desk", 7421);
    auto dialling = VirtualServer::options("one", types);
    dialling.dialHost = "desk";
    dialling.dialPort = 7421;
    const VirtualServer one(dialling, types, network);
    network.run(6s);
    ASSERT_FALSE(one.unreachable.empty());
    EXPECT_EQ(one.unreachable.front(),
              "desk:7421 (which did not say hello) did not complete the handshake within 5.0 s");

    network.listen(mute, "::1", 7420);
    auto options = VirtualClient::options("desk", types, {"::1"});
    options.connectTimeout = 20s;
    EXPECT_EQ(connectError(options),
              "[::1]:7420 (which did not say hello) did not complete the handshake within 5.0 s");
}

TEST_F(Handshake, BytesThatDripDoNotPutTheHandshakesEndOff) {
    auto stranger = network.dial("left", 7420);
    const wire::Bytes bytes = framed(hello(), 0, 0);
    for (std::size_t i = 0; i < 20 && !stranger.isClosed(); ++i) {
        stranger.send(std::span(bytes).subspan(i, 1));
        network.run(300ms);
    }
    EXPECT_TRUE(stranger.isClosed());
    EXPECT_TRUE(has(test::heard(stranger.answer()).lastText, "did not complete the handshake within 5.0 s"));
}

TEST_F(Handshake, AServerThatIsNotThereIsNamedWithinTheConnectTimeout) {
    auto options = VirtualClient::options("desk", types, {"left"});
    options.servers.push_back({"right", "nowhere", 1234, {}});
    VirtualClient client(options, types, network);
    const TimePoint start = network.now();
    ASSERT_TRUE(client.settle());
    EXPECT_EQ(network.now() - start, Duration(5s));
    EXPECT_EQ(client.errorText(),
              "server 'right' at nowhere:1234 cannot be reached: connection refused; is umbriel-server running there?");
}

// A tunnel takes calls before its far end is there, a crowded server takes them and hangs up.
TEST_F(Handshake, WhoHangsUpBeforeTheHelloIsCalledAgain) {
    auto crowded = VirtualServer::options("right", types);
    crowded.maxConnections = 0;
    auto hangsUp = std::make_unique<VirtualServer>(crowded, types, network);
    network.listen(hangsUp->node, "right", 7420);
    EXPECT_EQ(connectError(VirtualClient::options("desk", types, {"right"})),
              "server 'right' at right:7420 cannot be reached: it closes the connection before it says hello; is "
              "umbriel-server running there?");

    VirtualClient client(VirtualClient::options("desk", types, {"left", "right"}), types, network);
    network.run(2s);
    network.remove(hangsUp->node);
    VirtualServer right("right", types, network);
    network.listen(right.node, "right", 7420);
    ASSERT_TRUE(client.settle());
    EXPECT_EQ(client.errorText(), "");
}

TEST_F(Handshake, AServerThatStartsLateIsReached) {
    auto options = VirtualClient::options("desk", types, {"right"});
    VirtualClient client(options, types, network);
    network.run(2s);
    VirtualServer right("right", types, network);
    network.listen(right.node, "right", 7420);
    ASSERT_TRUE(client.settle());
    EXPECT_EQ(client.errorText(), "");
}

TEST_F(Handshake, AnotherClientIsRefusedByNameWhileTheFirstIsAlive) {
    VirtualClient first(VirtualClient::options("desk", types, {"left"}, 1), types, network);
    ASSERT_TRUE(first.settle());
    const std::string text = connectError(VirtualClient::options("sofa", types, {"left"}, 2));
    EXPECT_TRUE(has(text, "server 'left' is busy with client 'desk'")) << text;
    first.begin();
    ASSERT_TRUE(first.settle());
    EXPECT_EQ(first.errorText(), "") << "the first one is undisturbed";

    network.setSilent(first.client, true);
    network.run(3s);
    EXPECT_EQ(connectError(VirtualClient::options("sofa", types, {"left"}, 2)), "") << "its heartbeat is over";
}

TEST_F(Handshake, ANewerSessionOfTheSameClientFencesTheOldOne) {
    auto options = VirtualClient::options("desk", types, {"left"}, 1);
    VirtualClient old(options, types, network);
    ASSERT_TRUE(old.settle());
    old.scene.create<Transform>();
    old.begin();
    ASSERT_TRUE(old.settle());

    options.epoch = 2;
    VirtualClient newer(options, types, network);
    ASSERT_TRUE(newer.settle());
    EXPECT_EQ(newer.errorText(), "");
    network.run(10ms);
    EXPECT_TRUE(has(old.errorText(), "a newer session of the same client took over")) << old.errorText();
    newer.begin();
    ASSERT_TRUE(newer.settle());
    EXPECT_EQ(newer.errorText(), "");
    EXPECT_EQ(left.scene.containerCount(), 0u) << "the old session's state is gone";

    options.epoch = 2;
    EXPECT_TRUE(has(connectError(options), "session epoch 2 is not newer than 2"));
}

TEST_F(Handshake, MessagesOfAnOldEpochOrSequenceCloseTheSession) {
    for (const auto& [epoch, sequence, part] : {std::tuple{4u, 2u, "epoch 4 in epoch 5"}, std::tuple{5u, 1u, "message 1 came where 2"},
                                               std::tuple{5u, 3u, "message 3 came where 2"}}) {
        wire::Bytes bytes = framed(hello(9, 5), 0, 0);
        for (const auto& more : {framed(wire::Welcome{}, 5, 1), framed(wire::Heartbeat{}, epoch, sequence)})
            bytes.insert(bytes.end(), more.begin(), more.end());
        const auto answer = answerTo(bytes);
        EXPECT_EQ(answer.types.back(), MessageType::Goodbye);
        EXPECT_TRUE(has(answer.lastText, part)) << answer.lastText;
    }
}

TEST_F(Handshake, WhatIsNoProtocolIsClosedAndNobodyElseNotices) {
    VirtualClient client(VirtualClient::options("desk", types, {"left"}), types, network);
    ASSERT_TRUE(client.settle());
    client.begin();
    wire::Bytes http;
    for (const char c : std::string("GET / HTTP/1.1\r\nHost: left\r\n\r\n")) http.push_back(static_cast<std::byte>(c));
    answerTo(http);
    wire::Bytes tooLong(wire::kHeaderBytes);
    wire::encodeHeader({5000, 1, 0, 0}, std::span(tooLong).first<wire::kHeaderBytes>());
    EXPECT_TRUE(has(answerTo(tooLong).lastText, "5000 bytes")) << "refused by its header alone";
    EXPECT_TRUE(has(answerTo(framed(wire::Swap{1}, 0, 0)).lastText, "first message is not a hello"));
    wire::Bytes twice = framed(hello(), 0, 0);
    const wire::Bytes again = framed(hello(), 0, 1);
    twice.insert(twice.end(), again.begin(), again.end());
    answerTo(twice);
    ASSERT_TRUE(client.settle());
    EXPECT_EQ(client.errorText(), "");
}

TEST_F(Handshake, SilenceBeforeTheWelcomeEndsAfterFiveSeconds) {
    auto stranger = network.dial("left", 7420);
    network.run(4900ms);
    EXPECT_FALSE(stranger.isClosed());
    network.run(200ms);
    EXPECT_TRUE(stranger.isClosed());
    auto halfway = network.dial("left", 7420);  // a hello, never a welcome: it does not keep others out for ever
    halfway.send(framed(hello(), 0, 0));
    network.run(5100ms);
    EXPECT_TRUE(halfway.isClosed());
    EXPECT_EQ(connectError(VirtualClient::options("desk", types, {"left"})), "");
}

TEST_F(Handshake, ABulkConnectionMustShowTheSessionsToken) {
    VirtualClient client(VirtualClient::options("desk", types, {"left"}, 1), types, network);
    ASSERT_TRUE(client.settle());
    wire::Hello bulk = hello(2, 1);
    bulk.channel = wire::Channel::Bulk;
    EXPECT_TRUE(has(answerTo(framed(bulk, 0, 0)).lastText, "no session that this bulk connection belongs to"));
    bulk.token = {1, 1};
    EXPECT_TRUE(has(answerTo(framed(bulk, 0, 0)).lastText, "has a bulk connection already"));
    client.begin();
    ASSERT_TRUE(client.settle());
    EXPECT_EQ(client.errorText(), "");
}

// Every message in the wrong place, one connection each.
TEST_F(Handshake, WhatAClientMayNotSayClosesItsSession) {
    wire::Assign assign{{10, 10}, {{0, {0, 0, 10, 10}, Eye::Mono}}};
    const wire::Bytes views = wire::encodeViews({});
    wire::Frame first;
    first.number = 3;
    first.time = 0.0;
    first.views = views;
    first.fromNothing = true;
    const std::vector<std::pair<std::vector<wire::Bytes>, std::string>> cases = {
        {{framed(wire::Ready{}, 1, 2)}, "does not belong on a client's control connection"},
        {{framed(wire::BlobData{}, 1, 2)}, "does not belong on a client's control connection"},
        {{framed(first, 1, 2)}, "before tiles were assigned"},
        {{framed(assign, 1, 2), framed(wire::Frame{1, false, false, false, {}, {}, {}}, 1, 3)}, "needs views and a time"},
        {{framed(assign, 1, 2), framed(wire::Swap{1}, 1, 3)}, "swap of frame 1, which is not ready"},
        {{framed(assign, 1, 2), framed(first, 1, 3), framed(wire::Frame{3, false, false, false, {}, {}, {}}, 1, 4)},
         "frame 3 after frame 3"},
        {{framed(wire::BlobWanted{{{1, 2}}}, 1, 2)}, "is no result of this session"},
    };
    for (const auto& [messages, reason] : cases) {
        wire::Bytes bytes = framed(hello(), 0, 0);
        const wire::Bytes welcome = framed(wire::Welcome{}, 1, 1);
        bytes.insert(bytes.end(), welcome.begin(), welcome.end());
        for (const auto& message : messages) bytes.insert(bytes.end(), message.begin(), message.end());
        const auto answer = answerTo(bytes);
        EXPECT_TRUE(has(answer.lastText, reason)) << answer.lastText;
    }
}

TEST_F(Handshake, AClientThatRunsAheadIsStopped) {
    left.stalled = true;
    wire::Bytes bytes;
    const wire::Bytes views = wire::encodeViews({});
    const auto add = [&](const wire::Bytes& more) { bytes.insert(bytes.end(), more.begin(), more.end()); };
    add(framed(hello(), 0, 0));
    add(framed(wire::Welcome{}, 1, 1));
    add(framed(wire::Assign{{10, 10}, {}}, 1, 2));
    for (std::uint32_t i = 1; i <= 3; ++i) add(framed(wire::Frame{i, false, false, i == 1, 0.0, views, {}}, 1, 2 + i));
    EXPECT_TRUE(has(answerTo(bytes).lastText, "more frames than this server takes at once"));
}

}  // namespace
}  // namespace umbriel
