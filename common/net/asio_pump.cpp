#include "common/net/asio_pump.h"

#define BOOST_ASIO_SEPARATE_COMPILATION
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <map>
#include <utility>
#include <vector>

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
        std::vector<std::byte> buffer;
        bool writing = false;
        bool closing = false;    // the endpoint wants it closed
        bool shutDown = false;   // our side was ended, the peer's end is awaited
        TimePoint closeAt = TimePoint::max();
    };

    protocol::Endpoint& endpoint;
    bool insecureLan;
    SteadyClock clock;
    boost::asio::io_context context{1};
    boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work{context.get_executor()};
    boost::asio::steady_timer timer{context};
    boost::asio::steady_timer warningTimer{context};
    std::vector<std::unique_ptr<tcp::acceptor>> acceptors;
    std::map<ConnectionId, std::unique_ptr<Connection>> connections;
    std::map<ConnectionId, std::unique_ptr<tcp::resolver>> resolvers;
    ConnectionId nextId = 1;
    std::function<void()> hook;
    TimePoint armedFor = TimePoint::max();
    bool warning = false;
    bool turnDue = false;

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
        endpoint.dialFailed(tag, reason, clock.now());
        turn();
    }

    void add(tcp::socket socket, std::uint64_t tag) {
        error_code ignored;
        socket.set_option(tcp::no_delay(true), ignored);
        const unsigned timeout = kUserTimeoutMilliseconds;
        ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_USER_TIMEOUT, &timeout, sizeof(timeout));
        socket.non_blocking(true, ignored);
        const ConnectionId id = nextId++;
        auto& connection = *(connections[id] = std::make_unique<Connection>(std::move(socket)));
        connection.buffer.resize(kReadBytes);
        endpoint.opened(id, tag, clock.now());
        read(id, connection);
        turnSoon();
    }

    void read(ConnectionId id, Connection& connection) {
        connection.socket.async_read_some(
            boost::asio::buffer(connection.buffer), [this, id](error_code error, std::size_t count) {
                const auto found = connections.find(id);
                if (found == connections.end()) return;
                Connection& connection = *found->second;
                if (error) return finish(id, error == boost::asio::error::eof ? std::string("the connection was closed")
                                                                               : lowerFirst(error.message()));
                if (!connection.closing)
                    endpoint.received(id, std::span(connection.buffer).first(count), clock.now());
                read(id, connection);
                turnSoon();
            });
    }

    void finish(ConnectionId id, const std::string& reason) {
        connections.erase(id);
        endpoint.closed(id, reason, clock.now());
        turnSoon();
    }

    void write(ConnectionId id, Connection& connection) {
        protocol::SendQueue* queue = endpoint.output(id);
        if (connection.writing || connection.shutDown) return;
        if (!queue || queue->empty()) {
            if (!connection.closing) return;
            // The peer must be able to read our last words: end our side only, and wait for its end.
            error_code ignored;
            connection.socket.shutdown(tcp::socket::shutdown_send, ignored);
            connection.shutDown = true;
            return;
        }
        std::vector<boost::asio::const_buffer> buffers;
        for (const auto span : queue->gather(kSegmentsPerWrite)) buffers.emplace_back(span.data(), span.size());
        connection.writing = true;
        connection.socket.async_write_some(buffers, [this, id](error_code error, std::size_t count) {
            const auto found = connections.find(id);
            if (found == connections.end()) return;
            found->second->writing = false;
            // A broken connection is noticed by the read, which may still find what the peer said last.
            if (error) return;
            if (protocol::SendQueue* queue = endpoint.output(id)) queue->consumed(count);
            endpoint.written(id, clock.now());
            turnSoon();
        });
    }

    // Once for all that has happened by now: a turn looks at every connection, and a frame's answers come together.
    void turnSoon() {
        if (std::exchange(turnDue, true)) return;
        boost::asio::post(context, [this] {
            turnDue = false;
            turn();
        });
    }

    void turn() {
        if (hook) hook();
        while (const auto action = endpoint.nextAction()) {
            if (action->kind == Action::Kind::Dial) {
                dial(*action);
            } else if (const auto found = connections.find(action->connection); found != connections.end()) {
                found->second->closing = true;
                found->second->closeAt = clock.now() + kLinger;
            }
        }
        TimePoint next = endpoint.deadline();
        for (auto& [id, connection] : connections) {
            write(id, *connection);
            next = std::min(next, connection->closeAt);
        }
        if (next == armedFor) return;
        armedFor = next;
        if (next == TimePoint::max()) {
            timer.cancel();
            return;
        }
        timer.expires_at(std::chrono::time_point_cast<std::chrono::steady_clock::duration>(next));
        timer.async_wait([this](error_code error) {
            if (error) return;
            armedFor = TimePoint::max();
            const TimePoint now = clock.now();
            std::vector<ConnectionId> overdue;
            for (const auto& [id, connection] : connections)
                if (now >= connection->closeAt) overdue.push_back(id);
            for (const ConnectionId id : overdue) {
                connections.erase(id);
                endpoint.closed(id, "the connection was closed", now);
            }
            endpoint.advance(now);
            turn();
        });
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
    boost::asio::post(_implementation->context, [this] { _implementation->turn(); });
    _implementation->context.run();
}

void AsioPump::stop() { _implementation->context.stop(); }

void AsioPump::post(std::function<void()> function) {
    boost::asio::post(_implementation->context, [this, function = std::move(function)] {
        function();
        _implementation->turn();
    });
}

}  // namespace umbriel::net
