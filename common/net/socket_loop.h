#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/protocol/endpoint.h"

namespace umbriel::net {

// Reads and writes an endpoint's connected sockets, with epoll: what a frame's messages pass. The floor is a system
// call for each message, and with dozens of servers on a machine every further call, and every line of code in between,
// is cold when its process wakes; Asio's scheduler took as long as all of the protocol. For the same reason a thread
// that waits for something listens itself meanwhile, where it can, instead of being woken by the thread in run().
class SocketLoop {
 public:
    // dial: what becomes of a Dial action; answered by adopt() or dialFailed(). Called inside the loop: it must not
    // wait.
    SocketLoop(protocol::Endpoint& endpoint, std::function<void(const protocol::Action&)> dial);
    ~SocketLoop();
    SocketLoop(const SocketLoop&) = delete;
    SocketLoop& operator=(const SocketLoop&) = delete;

    // See AsioPump.
    void onTurn(std::function<void()> hook) { _hook = std::move(hook); }
    void run();
    void stop();
    void post(std::function<void()> function);
    void enter(const std::function<void()>& function);
    bool wait(const std::function<bool()>& condition, Duration limit);

    // Takes over a connected socket. tag: of the dial, 0 when it was accepted. From any thread.
    void adopt(int socket, std::uint64_t tag);
    void dialFailed(std::uint64_t tag, const Error& reason);

 private:
    using Id = protocol::ConnectionId;

    struct Connection {
        explicit Connection(int s) : socket(s) {}
        int socket;
        bool blocked = false;   // epoll says when it can be written again
        bool broken = false;    // nothing can be written any more; the read says why
        bool closing = false;   // the endpoint wants it closed
        bool shutDown = false;  // our side was ended, the peer's end is awaited
        TimePoint closeAt = TimePoint::max();
    };

    // Of a thread in wait().
    struct Waiting {
        const std::function<bool()>& condition;
        bool met = false;
    };

    // Waits for what comes, for so long at most, and handles it. One thread at a time; the lock is held before and
    // after.
    void listen(std::unique_lock<std::mutex>& lock, Duration limit);
    // While a thread in wait() listens, or may soon do so again.
    void rest(std::unique_lock<std::mutex>& lock);
    void serve(std::span<const std::pair<Id, std::uint32_t>> ready, std::optional<TimePoint> listenedUntil);
    void read(Id id, bool ended);
    void write(Id id);
    void setBlocked(Id id, Connection& connection, bool blocked);
    void close(Id id, const std::string& reason);
    void reached(TimePoint time);
    bool collectActions();
    bool carryOut();
    // Finds out whose wait is over. Returns whether one of them is to be notified; one that listens is woken.
    bool anyMet();
    void wake();
    void runPosted();
    void arm();

    protocol::Endpoint& _endpoint;
    std::function<void(const protocol::Action&)> _dial;
    std::function<void()> _hook;
    int _epoll = -1;
    int _event = -1;  // wakes the loop
    int _timer = -1;
    std::unique_ptr<std::byte[]> _buffer;

    // Held by whoever asks the endpoint, or touches what follows.
    std::mutex _mutex;
    std::condition_variable _awaited;
    std::vector<Waiting*> _waiting;
    bool _listening = false;           // some thread is in listen()
    Waiting* _helper = nullptr;        // one that listens until its wait is over
    TimePoint _helped = TimePoint();   // when a wait was over last
    std::condition_variable _resting;  // the thread in run()
    SteadyClock _clock;
    TimePoint _now{};  // when the loop was entered last: time stands still inside
    TimePoint _armedFor = TimePoint::max();
    TimePoint _closeDue = TimePoint::max();  // not later than any connection's closeAt
    std::map<Id, Connection> _connections;
    Id _nextId = 1;
    std::deque<protocol::Action> _actions;
    bool _turnDue = true;

    std::mutex _postMutex;  // of what follows: whoever posts may be inside
    std::vector<std::function<void()>> _posted;
    std::atomic<bool> _woken = false;
    std::atomic<bool> _stopped = false;
};

}  // namespace umbriel::net
