#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "common/protocol/endpoint.h"

namespace umbriel::net {

// The asio pump's twin for tests: endpoints in one thread on a virtual clock, over connections in memory with latency,
// split reads, silence and resets. The same seed gives the same run.
class MemoryNetwork {
 public:
    struct Options {
        std::uint64_t seed = 1;
        Duration minLatency = std::chrono::microseconds(50);
        Duration maxLatency = std::chrono::microseconds(50);
        bool splitReads = false;  // deliver in pieces of 1 to 64 bytes now and then
        std::size_t window = 0;   // bytes under way in one direction of a connection; more wait in its queue. 0: any
    };

    explicit MemoryNetwork(const Options& options);

    TimePoint now() const { return _now; }
    // The endpoint is on the network until remove(). hook: what its program does after every call.
    void add(protocol::Endpoint& endpoint, std::function<void()> hook = {});
    void listen(protocol::Endpoint& endpoint, const std::string& host, std::uint16_t port);
    // The program was killed: its connections are reset.
    void remove(protocol::Endpoint& endpoint);
    // While silent nothing reaches it and nothing leaves it; its connections stay (a pulled cable). What was under way
    // arrives when the silence ends, as TCP repeats it.
    void setSilent(protocol::Endpoint& endpoint, bool silent);
    // While paused its program does nothing (a stopped process): what arrives waits for it, its timers too.
    void setPaused(protocol::Endpoint& endpoint, bool paused);
    // From now on its nth connection that still lives (0: the oldest, a session's control connection) carries so many
    // bytes a second at most, in either direction. 0: nothing arrives any more, as from or to a program that does not
    // read.
    void setPace(protocol::Endpoint& endpoint, std::size_t nth, std::uint64_t bytesPerSecond);
    // Resets one of its connections, if it has any: what is under way is lost.
    void reset(protocol::Endpoint& endpoint);
    // Resets all of them, but only the other sides are told: the endpoint finds out by their silence.
    void resetHalf(protocol::Endpoint& endpoint);
    // Its program's clock shows so much more than the network's now, and runs so many times as fast.
    void setClock(protocol::Endpoint& endpoint, Duration ahead, double rate);
    // On its program's clock.
    TimePoint now(const protocol::Endpoint& endpoint) const { return clockOf(&endpoint).local(_now); }
    // After its program changed the endpoint outside a hook.
    void poke(protocol::Endpoint& endpoint);

    // Runs until the condition holds (true) or that much time has passed (false).
    bool runUntil(const std::function<bool()>& condition, Duration limit);
    void run(Duration time);

    // A connection by hand, as a stranger has it: bytes to an endpoint, and what it answers.
    class Stranger {
     public:
        void send(std::span<const std::byte> bytes);
        void close();
        const std::vector<std::byte>& answer() const { return *_answer; }
        bool isClosed() const { return *_closed; }

     private:
        friend class MemoryNetwork;
        MemoryNetwork* _network = nullptr;
        std::uint64_t _pipe = 0;
        std::shared_ptr<std::vector<std::byte>> _answer;
        std::shared_ptr<bool> _closed;
    };
    Stranger dial(const std::string& host, std::uint16_t port);

    // Bytes that wait in the queues of its connections.
    std::size_t queued(protocol::Endpoint& endpoint);

    // Bytes that were delivered, all connections together.
    std::uint64_t delivered() const { return _delivered; }

 private:
    struct HostClock {
        TimePoint since{};
        Duration ahead{};
        double rate = 1.0;
        TimePoint local(TimePoint network) const;
        TimePoint network(TimePoint local) const;
    };
    struct Host {
        HostClock clock;
        std::function<void()> hook;
        bool silent = false;
        bool paused = false;
        std::vector<std::function<void()>> held;                                    // what waits for the end of either
        std::vector<std::pair<protocol::ConnectionId, std::uint64_t>> connections;  // and their pipes
    };
    struct End {
        protocol::Endpoint* endpoint = nullptr;  // null: a stranger's
        protocol::ConnectionId id = 0;
        TimePoint busyUntil{};     // deliveries keep their order
        std::size_t underWay = 0;  // bytes sent from here and not delivered
        bool gone = false;
    };
    struct Pipe {
        End ends[2];
        std::shared_ptr<std::vector<std::byte>> answer;
        std::shared_ptr<bool> closed;
        bool cut = false;  // nothing passes, neither bytes nor the end
        std::optional<std::uint64_t> pace;  // bytes a second
    };
    using Key = std::pair<TimePoint, std::uint64_t>;

    HostClock clockOf(const protocol::Endpoint* endpoint) const;
    std::uint64_t random(std::uint64_t below);
    Duration latency();
    void at(TimePoint when, std::function<void()> what);
    void turn(protocol::Endpoint& endpoint);
    void resume(protocol::Endpoint& endpoint);
    // Runs it, or keeps it while the endpoint is silent or paused.
    void reach(protocol::Endpoint* endpoint, std::function<void()> what);
    void connect(protocol::Endpoint& endpoint, const protocol::Action& action, TimePoint since);
    void transmit(std::uint64_t pipe, int from, std::vector<std::byte> bytes);
    void hand(const End& end, std::span<const std::byte> bytes);
    void deliver(std::uint64_t pipe, int to, const std::vector<std::byte>& bytes);
    void hangUp(std::uint64_t pipe, int from);
    void endReaches(std::uint64_t pipe, int side, const std::string& reason);
    void endOf(std::uint64_t pipe, int side, const std::string& reason);
    protocol::ConnectionId attach(protocol::Endpoint& endpoint, std::uint64_t pipe);
    int sideOf(const Pipe& pipe, const protocol::Endpoint* endpoint, protocol::ConnectionId id) const;
    bool step(TimePoint limit);

    Options _options;
    std::uint64_t _random;
    TimePoint _now{};
    std::uint64_t _sequence = 0;
    std::map<Key, std::function<void()>> _events;
    std::map<const protocol::Endpoint*, Host> _hosts;
    std::vector<protocol::Endpoint*> _order;  // hosts in order of arrival: pointers have no order worth following
    std::map<std::pair<std::string, std::uint16_t>, protocol::Endpoint*> _listeners;
    std::map<std::uint64_t, Pipe> _pipes;
    std::uint64_t _nextPipe = 1;
    protocol::ConnectionId _nextConnection = 1;
    std::uint64_t _delivered = 0;
};

}  // namespace umbriel::net
