#include "common/net/asio_pump.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <linux/sockios.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <thread>

#include "tests/support/reserved_port.h"
#include "tests/support/wait_until.h"

namespace umbriel::net {
namespace {

using namespace std::chrono_literals;
using protocol::Action;
using protocol::ConnectionId;

// Sends back what it gets, dials when told to, and remembers what happened.
class Echo final : public protocol::Endpoint {
 public:
    void opened(ConnectionId id, std::uint64_t tag, TimePoint) override {
        _queues.emplace(id, std::make_unique<protocol::SendQueue>(std::size_t{64} << 20));
        _queues.at(id)->listIn(_outputs, id);
        if (tag != 0) dialled = id;
    }
    void dialFailed(std::uint64_t, const Error& why, TimePoint) override { set([&] { failure = why.message; }); }
    void received(ConnectionId id, std::span<const std::byte> bytes, TimePoint) override {
        if (putsOff) due = TimePoint::max();
        if (id == dialled) return set([&] { answer.insert(answer.end(), bytes.begin(), bytes.end()); });
        set([&] { heard += bytes.size(); });
        _queues.at(id)->push(bytes, std::span<const std::byte>());
    }
    void written(ConnectionId, TimePoint) override {}
    void closed(ConnectionId id, const std::string&, TimePoint) override {
        _queues.erase(id);
        set([&] { ++endings; });
    }
    void advance(TimePoint) override {
        due = TimePoint::max();
        set([&] { ++advances; });
    }
    TimePoint deadline() const override { return due; }
    std::optional<Action> nextAction() override {
        if (actions.empty()) return std::nullopt;
        const Action action = actions.back();
        actions.pop_back();
        return action;
    }
    protocol::SendQueue* output(ConnectionId id) override {
        const auto found = _queues.find(id);
        return found == _queues.end() ? nullptr : found->second.get();
    }
    std::optional<ConnectionId> nextOutput() override {
        if (_outputs.empty()) return std::nullopt;
        const ConnectionId id = _outputs.front();
        _outputs.pop_front();
        if (protocol::SendQueue* queue = output(id)) queue->takenFromList();
        return id;
    }

    // Inside the pump.
    bool isConnected() const { return !_queues.empty(); }
    void sayToAll(std::span<const std::byte> bytes) {
        for (const auto& [id, queue] : _queues) queue->push(bytes, std::span<const std::byte>());
    }

    template <class Condition>
    bool wait(Condition condition) {
        std::unique_lock lock(_mutex);
        return _changed.wait_for(lock, test::kPatience, condition);
    }

    std::vector<Action> actions;
    TimePoint due = TimePoint::max();
    bool putsOff = false;  // the deadline, with everything that comes
    ConnectionId dialled = 0;
    std::string failure;
    std::vector<std::byte> answer;
    std::size_t heard = 0;  // from who dialled us
    int endings = 0;
    int advances = 0;

 private:
    template <class Change>
    void set(Change change) {
        const std::lock_guard lock(_mutex);
        change();
        _changed.notify_all();
    }
    std::mutex _mutex;
    std::condition_variable _changed;
    std::map<ConnectionId, std::unique_ptr<protocol::SendQueue>> _queues;
    std::deque<ConnectionId> _outputs;
};

struct Running {
    Echo echo;
    AsioPump pump;
    std::thread thread;
    explicit Running(bool insecure = false) : pump(echo, insecure) {}
    void run() {
        thread = std::thread([this] { pump.run(); });
    }
    ~Running() {
        pump.stop();
        if (thread.joinable()) thread.join();
    }
    void dial(const std::string& host, std::uint16_t port) {
        pump.post([this, host, port] { echo.actions.push_back({Action::Kind::Dial, 0, 1, host, port}); });
    }
};

// One that listens and one that has dialled it.
struct Connected {
    Running listening, dialling;
    explicit Connected(const std::string& host = "127.0.0.1") {
        const auto port = listening.pump.listen("127.0.0.1", 0);
        EXPECT_TRUE(port) << port.error().message;
        listening.run();
        dialling.run();
        dialling.dial(host, *port);
        EXPECT_TRUE(listening.pump.wait([&] { return listening.echo.isConnected(); }, test::kPatience));
        EXPECT_TRUE(dialling.pump.wait([&] { return dialling.echo.dialled != 0; }, test::kPatience));
    }
};

TEST(AsioPump, AHostIsFoundByItsName) {
    addrinfo* found = nullptr;
    if (::getaddrinfo("localhost", nullptr, nullptr, &found) != 0)
        GTEST_SKIP() << "this machine has no name for itself (/etc/hosts)";
    ::freeaddrinfo(found);
    Connected both("localhost");
}

TEST(AsioPump, BytesArriveCompleteAndInOrder) {
    Connected both;
    wire::Bytes sent(8 << 20);
    for (std::size_t i = 0; i < sent.size(); ++i) sent[i] = static_cast<std::byte>(i * 7 + i / 251);
    const auto shared = std::make_shared<const wire::Bytes>(sent);
    Echo& client = both.dialling.echo;
    both.dialling.pump.post([&] { client.output(client.dialled)->push({}, shared); });
    ASSERT_TRUE(client.wait([&] { return client.answer.size() == sent.size(); }));
    EXPECT_TRUE(client.answer == sent);
}

TEST(AsioPump, LastWordsAreReadBeforeTheEnd) {
    Connected both;
    Echo& client = both.dialling.echo;
    both.dialling.pump.post([&] {
        client.output(client.dialled)->push(wire::Bytes(100, std::byte{1}), std::span<const std::byte>());
        client.actions.push_back({Action::Kind::Close, client.dialled, 0, {}, 0});
    });
    EXPECT_TRUE(client.wait([&] { return client.endings == 1; }));
    EXPECT_TRUE(both.listening.echo.wait([&] { return both.listening.echo.endings == 1; }));
    EXPECT_EQ(both.listening.echo.heard, 100u);
}

TEST(AsioPump, NothingBeyondLoopbackWithoutPermission) {
    Running pump;
    const auto port = pump.pump.listen("0.0.0.0", 0);
    ASSERT_FALSE(port);
    EXPECT_EQ(port.error().kind, Error::Kind::BadInput);
    EXPECT_NE(port.error().message.find("--insecure-lan"), std::string::npos);
    pump.run();
    pump.dial("192.0.2.1", 7420);
    ASSERT_TRUE(pump.echo.wait([&] { return !pump.echo.failure.empty(); }));
    EXPECT_NE(pump.echo.failure.find("--insecure-lan"), std::string::npos) << pump.echo.failure;

    Running allowed(true);
    EXPECT_TRUE(allowed.pump.listen("0.0.0.0", 0));
}

TEST(AsioPump, APortInUseAndAHostThatIsNotThereAreErrors) {
    Running first, second;
    const auto port = first.pump.listen("127.0.0.1", 0);
    ASSERT_TRUE(port);
    const auto again = second.pump.listen("127.0.0.1", *port);
    ASSERT_FALSE(again);
    EXPECT_NE(again.error().message.find("address already in use"), std::string::npos) << again.error().message;
    Running dialler;
    dialler.run();
    const test::ReservedPort nobody;
    dialler.dial("127.0.0.1", nobody.number());
    ASSERT_TRUE(dialler.echo.wait([&] { return !dialler.echo.failure.empty(); }));
    EXPECT_EQ(dialler.echo.failure, "connection refused");
}

// A program on a socket of its own that waits for one peer.
class PlainPeer {
 public:
    PlainPeer() : _listener(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof(address);
        EXPECT_EQ(::bind(_listener, reinterpret_cast<sockaddr*>(&address), size), 0);
        EXPECT_EQ(::listen(_listener, 1), 0);
        EXPECT_EQ(::getsockname(_listener, reinterpret_cast<sockaddr*>(&address), &size), 0);
        port = ntohs(address.sin_port);
    }
    ~PlainPeer() {
        ::close(_socket);
        ::close(_listener);
    }
    PlainPeer(const PlainPeer&) = delete;
    PlainPeer& operator=(const PlainPeer&) = delete;

    void accept() { _socket = ::accept4(_listener, nullptr, nullptr, SOCK_CLOEXEC); }
    // Returns when the bytes lie in the peer's socket: the system delivers in its own time, under load after send().
    void say(std::span<const std::byte> bytes) const {
        EXPECT_EQ(::send(_socket, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
        EXPECT_TRUE(test::waitUntil([&] {
            int onTheWay = 1;
            return ::ioctl(_socket, SIOCOUTQ, &onTheWay) == 0 && onTheWay == 0;
        }));
    }

    std::uint16_t port = 0;

 private:
    int _listener;
    int _socket = -1;
};

// A program that was stopped, or kept waiting for a processor: what its peer said meanwhile lies in the socket.
TEST(AsioPump, WhatHasComeIsReadBeforeADeadlineIsJudged) {
    PlainPeer peer;
    Running dialling;
    dialling.echo.putsOff = true;
    dialling.run();
    dialling.dial("127.0.0.1", peer.port);
    peer.accept();
    ASSERT_TRUE(dialling.pump.wait([&] { return dialling.echo.dialled != 0; }, test::kPatience));
    const wire::Bytes word(5, std::byte{1});
    for (std::size_t said = 0; said < 5; ++said) {
        dialling.pump.enter([&] {
            dialling.echo.due = SteadyClock().now();
            peer.say(word);
        });
        EXPECT_TRUE(dialling.echo.wait([&] { return dialling.echo.answer.size() > said * word.size(); }));
    }
    EXPECT_EQ(dialling.echo.advances, 0) << "it was held to be silent";
}

TEST(AsioPump, WhoWaitsHearsOfWhatComesAndOfWhatOthersDo) {
    Connected both;
    Running& dialling = both.dialling;
    // Back and forth, faster than the pump's own thread takes over, and slower.
    for (std::size_t i = 1; i <= 300; ++i) {
        if (i % 50 == 0) std::this_thread::sleep_for(1ms);
        dialling.pump.enter([&] { dialling.echo.sayToAll(wire::Bytes(1, std::byte{2})); });
        ASSERT_TRUE(dialling.pump.wait([&] { return dialling.echo.answer.size() >= i; }, test::kPatience)) << i;
    }
    // Several wait; one of them listens, and others change what they wait for, the next time before it has noticed.
    for (int round = 0; round < 100; ++round) {
        std::atomic<int> stage = 0;
        std::vector<std::thread> waiting;
        for (int i = 1; i <= 3; ++i)
            waiting.emplace_back(
                [&, i] { EXPECT_TRUE(dialling.pump.wait([&, i] { return stage >= i; }, test::kPatience)); });
        for (int i = 1; i <= 3; ++i) dialling.pump.enter([&] { ++stage; });
        for (auto& thread : waiting) thread.join();
    }
    EXPECT_FALSE(dialling.pump.wait([] { return false; }, 2ms));
    EXPECT_EQ(dialling.echo.answer.size(), 300u);
}

TEST(AsioPump, DeadlinesAreKept) {
    Running pump;
    pump.echo.due = SteadyClock().now() + 20ms;
    pump.run();
    EXPECT_TRUE(pump.echo.wait([&] { return pump.echo.advances == 1; }));
}

}  // namespace
}  // namespace umbriel::net
