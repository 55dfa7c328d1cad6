#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <future>
#include <thread>

#include "client/session/cluster.h"
#include "common/scene/core_types.h"
#include "server/session/render_server.h"
#include "tests/support/fake_renderer.h"
#include "tests/support/framed.h"
#include "tests/support/reserved_port.h"
#include "tests/support/wait_until.h"

namespace umbriel {
namespace {

using namespace std::chrono_literals;
using test::framed;
using test::kPatience;
using wire::MessageType;

bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

void append(wire::Bytes& bytes, const wire::Bytes& more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
}

// A real socket that says what it likes.
class Stranger {
 public:
    explicit Stranger(std::uint16_t port) : _socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        address.sin_port = htons(port);
        EXPECT_EQ(::connect(_socket, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    }
    ~Stranger() { ::close(_socket); }
    Stranger(const Stranger&) = delete;
    Stranger& operator=(const Stranger&) = delete;

    void say(std::span<const std::byte> bytes) const {
        // Less than a socket takes; a peer that has closed already is fine.
        (void)!::send(_socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    }
    void sayNoMore() const { ::shutdown(_socket, SHUT_WR); }
    // Everything the peer says until it closes, or until this message of it.
    test::Heard answer(std::optional<MessageType> until = {}) {
        for (;;) {
            const test::Heard heard = test::heard(_answer);
            if (until && !heard.types.empty() && heard.types.back() == *until) return heard;
            pollfd waiting{_socket, POLLIN, 0};
            if (::poll(&waiting, 1, static_cast<int>(kPatience / 1ms)) != 1) {
                ADD_FAILURE() << "the peer neither answers nor closes";
                return heard;
            }
            std::byte piece[4096];
            const ssize_t count = ::recv(_socket, piece, sizeof(piece), 0);
            if (count <= 0) return heard;
            _answer.insert(_answer.end(), piece, piece + count);
        }
    }

 private:
    int _socket;
    wire::Bytes _answer;
};

// A client and a server in this process. dials: the server reaches the client, whose port strangers reach, too.
class Wall {
 public:
    Wall(const TypeRegistry& types, bool dials) : _scene(types, _ids) {
        RenderServerOptions options;
        options.name = "left";
        options.build = "test";
        std::promise<std::uint16_t> listening;
        ClusterOptions cluster;
        if (dials) {
            port = _reserved.number();
            options.dialHost = "127.0.0.1";
            options.dialPort = port;
            cluster.listenHost = "127.0.0.1";
            cluster.listenPort = port;
            cluster.servers.push_back({"left", "", 0});
        } else {
            options.listening = [&](std::uint16_t value) { listening.set_value(value); };
        }
        _server = std::make_unique<RenderServer>(std::move(options), types, _renderer);
        _thread = std::thread([this] { (void)_server->run(); });
        if (!dials) {
            port = listening.get_future().get();
            cluster.servers.push_back({"left", "127.0.0.1", port});
        }
        cluster.connectTimeout = kPatience;
        addresses = cluster;
        auto connected = Cluster::connect(cluster, types, {{0, {0, 0, 10, 10}, Eye::Mono}});
        EXPECT_TRUE(connected) << connected.error().message;
        if (connected) _cluster = std::move(*connected);
        _views.wall = {10, 10};
        _views.views.emplace_back();
        _views.views.back().region = {0, 0, 10, 10};
    }
    ~Wall() {
        _cluster.reset();
        _server->stop();
        _thread.join();
    }
    void expectUndisturbed() {
        const auto frame = _cluster->frame(_scene, _views, _time += 1.0, true);
        ASSERT_TRUE(frame) << frame.error().message;
        EXPECT_EQ(frame->tiles.size(), 1u);
    }
    void letTheClientGo() { _cluster.reset(); }

    std::uint16_t port = 0;
    ClusterOptions addresses;

 private:
    const test::ReservedPort _reserved;
    test::FakeRenderer _renderer;
    std::unique_ptr<RenderServer> _server;
    std::thread _thread;
    IdSource _ids;
    Aspect _scene;
    WallViews _views;
    double _time = 0.0;
    std::unique_ptr<Cluster> _cluster;
};

struct BadInput : testing::TestWithParam<bool> {
    TypeRegistry types;
    BadInput() { registerCoreTypes(types); }
    wire::Hello hello() {
        wire::Hello hello;
        hello.name = GetParam() ? "middle" : "stranger";
        hello.build = "test";
        hello.role = GetParam() ? wire::Role::Server : wire::Role::Client;
        hello.typeSignature = types.signature();
        hello.token = {9, 9};
        hello.epoch = 1;
        hello.capabilities = wire::kKnownCapabilities;
        return hello;
    }
};

TEST_P(BadInput, GetsTheStatedAnswerOnBothPortsAndDisturbsNobody) {
    Wall wall(types, GetParam());
    const auto answerTo = [&](const wire::Bytes& bytes) {
        Stranger stranger(wall.port);
        stranger.say(bytes);
        const test::Heard heard = stranger.answer();
        wall.expectUndisturbed();
        return heard.lastText;
    };
    const auto header = [](std::uint32_t length, std::uint8_t type) {
        wire::Bytes bytes(wire::kHeaderBytes);
        wire::encodeHeader({length, type, 0, 0}, std::span(bytes).first<wire::kHeaderBytes>());
        return bytes;
    };
    EXPECT_TRUE(has(answerTo(wire::Bytes(1000, std::byte{0x47})), "message type 71 is unknown"));
    EXPECT_TRUE(has(answerTo(header(5000, 1)), "a Hello message of 5000 bytes, 4083 are allowed"));
    EXPECT_TRUE(has(answerTo(header(0, 4)), "the first message is not a hello"));
    EXPECT_TRUE(has(answerTo(framed(hello(), 7, 0)), "session epoch 7 in epoch 0"));
    EXPECT_TRUE(has(answerTo(framed(hello(), 0, 3)), "message 3 came where 0 was due"));
    wire::Bytes spoilt = framed(hello(), 0, 0);
    spoilt[wire::kHeaderBytes] ^= std::byte{1};
    EXPECT_TRUE(has(answerTo(spoilt), "this is not an Umbriel peer"));
    wire::Hello other = hello();
    other.version = 77;
    EXPECT_TRUE(has(answerTo(framed(other, 0, 0)), "version 77"));
    other = hello();
    other.typeSignature ^= 1;
    EXPECT_TRUE(has(answerTo(framed(other, 0, 0)), "scene types"));
    other = hello();
    other.needs = std::uint64_t{1} << 50;
    EXPECT_TRUE(has(answerTo(framed(other, 0, 0)), "capability 50"));
    other = hello();
    other.channel = wire::Channel::Bulk;
    EXPECT_TRUE(has(answerTo(framed(other, 0, 0)), "no session that this bulk connection belongs to"));
    other = hello();
    other.maxChangeBytes = 5;
    EXPECT_TRUE(has(answerTo(framed(other, 0, 0)), "takes 5 bytes"));
    EXPECT_TRUE(has(answerTo(framed(hello(), 0, 0)),
                    GetParam() ? "does not wait for a server 'middle'" : "is busy with client"));
    // Cut off in the middle, at every byte of a head and of some of a hello.
    const wire::Bytes whole = framed(hello(), 0, 0);
    for (std::size_t size = 0; size < 40; ++size) {
        Stranger stranger(wall.port);
        stranger.say(std::span(whole).first(size));
        stranger.sayNoMore();
        EXPECT_EQ(stranger.answer().types, std::vector{MessageType::Hello}) << "its own, and then the end";
    }
    wall.expectUndisturbed();
}

// Strangers that say nothing are let in up to a bound; beyond it they are closed at once.
TEST_P(BadInput, OfManyStrangersAtOnceIsBounded) {
    Wall wall(types, GetParam());
    std::vector<std::unique_ptr<Stranger>> strangers;
    for (int i = 0; i < 200; ++i) strangers.push_back(std::make_unique<Stranger>(wall.port));
    wall.expectUndisturbed();
    strangers.back()->sayNoMore();
    EXPECT_TRUE(strangers.back()->answer().types.empty()) << "not even a hello: there are too many";
    wall.expectUndisturbed();
}

INSTANTIATE_TEST_SUITE_P(Ports, BadInput, testing::Bool(),
                         [](const auto& info) { return info.param ? "Clients" : "Servers"; });

struct Replay : BadInput {};

TEST_P(Replay, OfASessionIsRefusedWhileItLives) {
    Wall wall(types, false);
    wall.letTheClientGo();
    wire::Bytes session = framed(hello(), 0, 0);
    append(session, framed(wire::Welcome{}, 1, 1));
    append(session, framed(wire::Heartbeat{}, 1, 2));
    std::unique_ptr<Stranger> first;
    // The server notices in its own time that its client has left.
    ASSERT_TRUE(test::waitUntil([&] {
        first = std::make_unique<Stranger>(wall.port);
        first->say(framed(hello(), 0, 0));
        const test::Heard heard = first->answer(MessageType::Welcome);
        return !heard.types.empty() && heard.types.back() == MessageType::Welcome;
    }));
    first->say(std::span(session).subspan(framed(hello(), 0, 0).size()));
    Stranger again(wall.port);
    again.say(session);
    EXPECT_TRUE(has(again.answer().lastText, "session epoch 1 is not newer than 1"));
    // A message of an older session within the living one, and one that was heard already.
    first->say(framed(wire::Heartbeat{}, 0, 3));
    EXPECT_TRUE(has(first->answer().lastText, "a Heartbeat message of session epoch 0 in epoch 1"));
}

INSTANTIATE_TEST_SUITE_P(Ports, Replay, testing::Values(false));

TEST(TwoClients, OfOneServerTheSecondIsRefusedByName) {
    TypeRegistry types;
    registerCoreTypes(types);
    Wall wall(types, false);
    wall.expectUndisturbed();
    const auto second = Cluster::connect(wall.addresses, types, {{0, {0, 0, 10, 10}, Eye::Mono}});
    ASSERT_FALSE(second);
    EXPECT_TRUE(has(second.error().message, "server 'left' is busy with client 'umbriel-")) << second.error().message;
    wall.expectUndisturbed();
}

}  // namespace
}  // namespace umbriel
