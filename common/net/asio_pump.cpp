#include "common/net/asio_pump.h"

#define BOOST_ASIO_SEPARATE_COMPILATION
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <array>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "common/base/assert.h"
#include "common/base/clock.h"
#include "common/base/log.h"

namespace umbriel::net {

using boost::asio::ip::tcp;
using boost::system::error_code;
using protocol::Action;
using protocol::ConnectionId;

namespace {

constexpr std::size_t kReadBytes = 256 * 1024;
constexpr std::size_t kSegmentsPerWrite = 32;
// What one connection writes before others have their turn.
constexpr std::size_t kBytesPerTurn = 512 * 1024;
// How long a closing connection may take to write its last words and see the peer's end.
constexpr auto kLinger = std::chrono::seconds(1);
constexpr auto kDialPatience = std::chrono::seconds(1);
// Unacknowledged data for this long means the peer's machine or the way to it is gone.
constexpr unsigned kUserTimeoutMilliseconds = 2000;

std::string lowerFirst(std::string text) {
    if (!text.empty()) text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
    return text;
}

std::string insecureRefusal(const tcp::endpoint& where) {
    return fmt::format("{} is beyond this machine, and plain TCP is neither encrypted nor authenticated; "
                       "--insecure-lan allows it on a network you trust", where.address().to_string());
}

}  // namespace

struct AsioPump::Implementation {
    struct Connection {
        explicit Connection(tcp::socket s) : socket(std::move(s)) {}
        tcp::socket socket;
        // Not initialised: most connections never touch more than its first page.
        std::unique_ptr<std::byte[]> buffer{new std::byte[kReadBytes]};
        bool blocked = false;    // the socket took no more, or others have their turn: somebody will go on
        bool broken = false;     // nothing can be written any more; the read says why
        bool closing = false;    // the endpoint wants it closed
        bool shutDown = false;   // our side was ended, the peer's end is awaited
        TimePoint closeAt = TimePoint::max();
    };

    protocol::Endpoint& endpoint;
    bool insecureLan;
    SteadyClock clock;
    // Sockets and timers are used by the thread in run() alone; others post, or write to a descriptor.
    boost::asio::io_context context{BOOST_ASIO_CONCURRENCY_HINT_UNSAFE_IO};
    boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work{context.get_executor()};
    boost::asio::steady_timer timer{context};
    boost::asio::steady_timer warningTimer{context};
    std::vector<std::unique_ptr<tcp::acceptor>> acceptors;
    std::map<ConnectionId, std::unique_ptr<Connection>> connections;
    std::map<ConnectionId, std::unique_ptr<tcp::resolver>> resolvers;
    ConnectionId nextId = 1;
    std::function<void()> hook;
    TimePoint armedFor = TimePoint::max();
    TimePoint closeDue = TimePoint::max();  // not later than any connection's closeAt
    bool warning = false;
    std::deque<Action> actions;  // that another thread found; the pump's thread takes them

    // Held by whoever asks the endpoint, or touches what is here.
    std::mutex mutex;
    std::condition_variable awaited;
    // Of a thread in wait().
    struct Waiting {
        const std::function<bool()>& condition;
        bool met = false;
    };
    std::vector<Waiting*> waiting;

    Implementation(protocol::Endpoint& e, bool insecure) : endpoint(e), insecureLan(insecure) {}

    void warnEveryMinute() {
        log::warning("plain TCP beyond this machine: whoever is on the network can read and alter the scene (--insecure-lan)");
        warningTimer.expires_after(std::chrono::minutes(1));
        warningTimer.async_wait([this](error_code error) {
            if (!error) warnEveryMinute();
        });
    }

    // Whether this address may be used; starts the warnings when it is beyond loopback.
    bool allowed(const tcp::endpoint& where) {
        if (where.address().is_loopback()) return true;
        if (insecureLan && !std::exchange(warning, true)) warnEveryMinute();
        return insecureLan;
    }

    Result<std::uint16_t> listen(const std::string& host, std::uint16_t port) {
        error_code error;
        tcp::resolver resolver(context);
        const auto found = resolver.resolve(host, std::to_string(port), tcp::resolver::passive, error);
        if (error) return badInput(fmt::format("cannot listen on {}:{}: {}", host, port, lowerFirst(error.message())));
        const tcp::endpoint where = found.begin()->endpoint();
        if (!allowed(where)) return badInput(fmt::format("refusing to listen on {}:{}: {}", host, port, insecureRefusal(where)));
        auto acceptor = std::make_unique<tcp::acceptor>(context);
        acceptor->open(where.protocol(), error);
        if (!error) acceptor->set_option(tcp::acceptor::reuse_address(true), error);
        if (!error) acceptor->bind(where, error);
        if (!error) acceptor->listen(boost::asio::socket_base::max_listen_connections, error);
        if (error) return failure(fmt::format("cannot listen on {}:{}: {}", host, port, lowerFirst(error.message())));
        const std::uint16_t bound = acceptor->local_endpoint(error).port();
        accept(*acceptor);
        acceptors.push_back(std::move(acceptor));
        return bound;
    }

    void accept(tcp::acceptor& acceptor) {
        acceptor.async_accept([this, &acceptor](error_code error, tcp::socket socket) {
            if (error == boost::asio::error::operation_aborted) return;
            if (!error) add(std::move(socket), 0);
            // Out of descriptors or memory: wait a little rather than spin.
            if (!error || error == boost::asio::error::connection_aborted) return accept(acceptor);
            auto pause = std::make_shared<boost::asio::steady_timer>(context, std::chrono::milliseconds(100));
            pause->async_wait([this, &acceptor, pause](error_code stopped) {
                if (!stopped) accept(acceptor);
            });
        });
    }

    void dial(const Action& action) {
        const ConnectionId id = nextId++;
        auto& resolver = resolvers[id] = std::make_unique<tcp::resolver>(context);
        const std::uint64_t tag = action.tag;
        resolver->async_resolve(
            action.host, std::to_string(action.port),
            [this, id, tag](error_code error, tcp::resolver::results_type found) {
                resolvers.erase(id);
                if (error == boost::asio::error::operation_aborted) return;
                if (error) return dialFailed(tag, failure("the host's address cannot be found (" + lowerFirst(error.message()) + ")"));
                std::vector<tcp::endpoint> addresses;
                for (const auto& entry : found) addresses.push_back(entry.endpoint());
                connectNext(std::move(addresses), 0, tag, failure("no address"));
            });
    }

    void connectNext(std::vector<tcp::endpoint> addresses, std::size_t index, std::uint64_t tag, Error reason) {
        while (index < addresses.size() && !allowed(addresses[index])) reason = badInput(insecureRefusal(addresses[index++]));
        if (index >= addresses.size()) return dialFailed(tag, reason);
        auto socket = std::make_shared<tcp::socket>(context);
        const tcp::endpoint address = addresses[index];
        // The kernel goes on for two minutes; whoever dials wants to hear of a host that is gone, and to reach it soon
        // after it is back.
        auto patience = std::make_shared<boost::asio::steady_timer>(context, kDialPatience);
        patience->async_wait([socket](error_code stopped) {
            error_code ignored;
            if (!stopped) socket->close(ignored);
        });
        socket->async_connect(address, [this, socket, patience, addresses = std::move(addresses), index, tag](error_code error) mutable {
            patience->cancel();
            if (error == boost::asio::error::operation_aborted) error = boost::asio::error::timed_out;
            if (error) return connectNext(std::move(addresses), index + 1, tag, failure(lowerFirst(error.message())));
            add(std::move(*socket), tag);
        });
    }

    void dialFailed(std::uint64_t tag, const Error& reason) {
        visit([&] { endpoint.dialFailed(tag, reason, clock.now()); });
    }

    void add(tcp::socket socket, std::uint64_t tag) {
        error_code ignored;
        socket.set_option(tcp::no_delay(true), ignored);
        const unsigned timeout = kUserTimeoutMilliseconds;
        ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_USER_TIMEOUT, &timeout, sizeof(timeout));
        socket.non_blocking(true, ignored);
        const ConnectionId id = nextId++;
        visit([&] {
            connections[id] = std::make_unique<Connection>(std::move(socket));
            endpoint.opened(id, tag, clock.now());
        });
        read(id, *connections[id]);
    }

    void read(ConnectionId id, Connection& connection) {
        connection.socket.async_read_some(
            boost::asio::buffer(connection.buffer.get(), kReadBytes), [this, id](error_code error, std::size_t count) {
                const auto found = connections.find(id);
                if (found == connections.end()) return;
                Connection& connection = *found->second;
                if (error)
                    return finish(id, error == boost::asio::error::eof ? std::string("the connection was closed")
                                                                       : lowerFirst(error.message()));
                if (!connection.closing)
                    visit([&] {
                        endpoint.received(id, std::span(connection.buffer.get(), count), clock.now());
                    });
                if (connections.count(id) > 0) read(id, connection);
            });
    }

    void finish(ConnectionId id, const std::string& reason) {
        visit([&] {
            connections.erase(id);
            endpoint.closed(id, reason, clock.now());
        });
    }

    // On the pump's thread: alone with the endpoint, then a turn.
    template <class Function>
    void visit(Function&& function) {
        bool wake = false;
        {
            const std::lock_guard lock(mutex);
            function();
            wake = turn();
        }
        if (wake) awaited.notify_one();
    }

    // What the endpoint wants done, on the pump's thread. Returns whether the thread in wait() is to be woken, which is
    // done without the lock that it needs.
    bool turn() {
        carryOut();
        if (hook) {
            hook();
            carryOut();
        }
        arm();
        return anyMet();
    }

    // Whether some thread's wait is over.
    bool anyMet() {
        return std::erase_if(waiting, [](Waiting* one) { return one->met = one->condition(); }) > 0;
    }

    bool collectActions() {
        while (const auto action = endpoint.nextAction()) actions.push_back(*action);
        return !actions.empty();
    }

    void carryOut() {
        do {
            collectActions();
            while (!actions.empty()) {
                const Action action = std::move(actions.front());
                actions.pop_front();
                if (action.kind == Action::Kind::Dial) {
                    dial(action);
                } else if (const auto found = connections.find(action.connection); found != connections.end()) {
                    found->second->closing = true;
                    found->second->closeAt = clock.now() + kLinger;
                    closeDue = std::min(closeDue, found->second->closeAt);
                    if (write(action.connection) != Room::Enough) goOnWriting(action.connection);
                }
            }
            while (const auto id = endpoint.nextOutput())
                if (write(*id) != Room::Enough) goOnWriting(*id);
        } while (collectActions());
    }

    enum class Room { Enough, None, OthersTurn };

    // Writes what is queued, as far as the socket takes it at once. From any thread: it asks the descriptor alone.
    Room write(ConnectionId id) {
        const auto found = connections.find(id);
        if (found == connections.end()) return Room::Enough;
        Connection& connection = *found->second;
        if (connection.blocked || connection.broken || connection.shutDown) return Room::Enough;
        std::size_t written = 0;
        for (protocol::SendQueue* queue = endpoint.output(id); queue && !queue->empty(); queue = endpoint.output(id)) {
            if (written >= kBytesPerTurn) {
                connection.blocked = true;
                return Room::OthersTurn;
            }
            const ssize_t count = send(connection.socket.native_handle(), *queue);
            if (count < 0 && errno == EINTR) continue;
            if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
                connection.blocked = true;
                return Room::None;
            }
            if (count < 0) {
                // Noticed by the read, which may still find what the peer said last.
                connection.broken = true;
                return Room::Enough;
            }
            written += static_cast<std::size_t>(count);
            queue->consumed(static_cast<std::size_t>(count));
            endpoint.written(id, clock.now());
        }
        if (connection.closing) {
            // The peer must be able to read our last words: end our side only, and wait for its end.
            ::shutdown(connection.socket.native_handle(), SHUT_WR);
            connection.shutDown = true;
        }
        return Room::Enough;
    }

    static ssize_t send(int descriptor, const protocol::SendQueue& queue) {
        std::array<std::span<const std::byte>, kSegmentsPerWrite> pieces;
        const std::size_t count = queue.gather(pieces);
        if (count == 1) return ::send(descriptor, pieces[0].data(), pieces[0].size(), MSG_DONTWAIT | MSG_NOSIGNAL);
        std::array<iovec, kSegmentsPerWrite> vectors;
        for (std::size_t i = 0; i < count; ++i)
            vectors[i] = {const_cast<std::byte*>(pieces[i].data()), pieces[i].size()};
        msghdr message{};
        message.msg_iov = vectors.data();
        message.msg_iovlen = count;
        return ::sendmsg(descriptor, &message, MSG_DONTWAIT | MSG_NOSIGNAL);
    }

    // On the pump's thread, for a connection that is blocked.
    void goOnWriting(ConnectionId id) {
        const auto found = connections.find(id);
        if (found == connections.end()) return;
        found->second->socket.async_wait(tcp::socket::wait_write, [this, id](error_code error) {
            const auto found = connections.find(id);
            if (error || found == connections.end()) return;
            visit([&] {
                found->second->blocked = false;
                if (write(id) != Room::Enough) goOnWriting(id);
            });
        });
    }

    void enter(const std::function<void()>& function) {
        bool wake = false;
        bool turnNeeded = false;
        {
            const std::lock_guard lock(mutex);
            function();
            while (const auto id = endpoint.nextOutput()) {
                if (write(*id) == Room::Enough) continue;
                boost::asio::post(context, [this, id = *id] { goOnWriting(id); });
            }
            // What a socket is needed for is left to the thread that may use it.
            turnNeeded = collectActions() || endpoint.deadline() < armedFor;
            wake = anyMet();
        }
        if (turnNeeded) post([] {});
        if (wake) awaited.notify_all();
    }

    void post(std::function<void()> function) {
        boost::asio::post(context, [this, function = std::move(function)] { visit(function); });
    }

    bool wait(const std::function<bool()>& asked, Duration limit) {
        std::unique_lock lock(mutex);
        if (asked()) return true;
        Waiting mine{asked};
        waiting.push_back(&mine);
        awaited.wait_for(lock, limit, [&] { return mine.met; });
        if (mine.met) return true;
        std::erase(waiting, &mine);
        return false;
    }

    // The timer is only ever moved forward: deadlines are mostly put off before they are reached, and one that comes too
    // early costs less than setting it anew with every message.
    void arm() {
        const TimePoint next = std::min(endpoint.deadline(), closeDue);
        if (next >= armedFor) return;
        armedFor = next;
        timer.expires_at(std::chrono::time_point_cast<std::chrono::steady_clock::duration>(next));
        timer.async_wait([this](error_code error) {
            if (error) return;
            visit([&] { reached(clock.now()); });
        });
    }

    void reached(TimePoint now) {
        armedFor = TimePoint::max();
        if (now >= closeDue) {
            closeDue = TimePoint::max();
            std::vector<ConnectionId> overdue;
            for (const auto& [id, connection] : connections) {
                if (now >= connection->closeAt)
                    overdue.push_back(id);
                else
                    closeDue = std::min(closeDue, connection->closeAt);
            }
            for (const ConnectionId id : overdue) {
                connections.erase(id);
                endpoint.closed(id, "the connection was closed", now);
            }
        }
        if (now >= endpoint.deadline()) endpoint.advance(now);
    }
};

AsioPump::AsioPump(protocol::Endpoint& endpoint, bool insecureLan)
    : _implementation(std::make_unique<Implementation>(endpoint, insecureLan)) {}

AsioPump::~AsioPump() = default;

Result<std::uint16_t> AsioPump::listen(const std::string& host, std::uint16_t port) {
    return _implementation->listen(host, port);
}

void AsioPump::onTurn(std::function<void()> hook) { _implementation->hook = std::move(hook); }

void AsioPump::run() {
    post([] {});
    _implementation->context.run();
}

void AsioPump::stop() { _implementation->context.stop(); }

void AsioPump::post(std::function<void()> function) { _implementation->post(std::move(function)); }

void AsioPump::enter(const std::function<void()>& function) { _implementation->enter(function); }

bool AsioPump::wait(const std::function<bool()>& condition, Duration limit) {
    return _implementation->wait(condition, limit);
}

}  // namespace umbriel::net
