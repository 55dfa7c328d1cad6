#include "common/net/asio_pump.h"

#define BOOST_ASIO_SEPARATE_COMPILATION
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <map>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/host_port.h"
#include "common/base/log.h"
#include "common/net/socket_loop.h"

namespace umbriel::net {

using boost::asio::ip::tcp;
using boost::system::error_code;
using protocol::Action;

namespace {

constexpr auto kDialPatience = std::chrono::seconds(1);

std::string lowerFirst(std::string text) {
    if (!text.empty()) text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
    return text;
}

// Nothing is congested between two processes of one machine, and an algorithm that paces what it sends (BBR) halves the
// throughput there: a timer's interrupt lies between segments. Reno is in every kernel and does not; what is set before
// the connection is made counts, for pacing once begun is kept.
void sendWithoutPauses(int socket) {
    constexpr std::string_view kAlgorithm = "reno";
    ::setsockopt(socket, IPPROTO_TCP, TCP_CONGESTION, kAlgorithm.data(), kAlgorithm.size());
}

std::string insecureRefusal(const tcp::endpoint& where) {
    return fmt::format("{} is beyond this machine, and plain TCP is neither encrypted nor authenticated; "
                       "--insecure-lan allows it on a network you trust", where.address().to_string());
}

}  // namespace

// Accepts and dials with Asio on a thread of its own, as both take their time; what is connected goes to the loop.
struct AsioPump::Implementation {
    SocketLoop loop;
    bool insecureLan;
    boost::asio::io_context context{1};
    boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work{context.get_executor()};
    boost::asio::steady_timer warningTimer{context};
    std::vector<std::unique_ptr<tcp::acceptor>> acceptors;
    std::map<std::uint64_t, std::unique_ptr<tcp::resolver>> resolvers;
    std::uint64_t nextResolver = 0;
    bool warning = false;
    std::thread thread;

    Implementation(protocol::Endpoint& endpoint, bool insecure)
        : loop(endpoint,
               [this](const Action& action) { boost::asio::post(context, [this, action] { dial(action); }); }),
          insecureLan(insecure) {}
    ~Implementation() {
        context.stop();
        if (thread.joinable()) thread.join();
    }

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
        if (error)
            return badInput(
                fmt::format("cannot listen on {}: {}", hostPortText(host, port), lowerFirst(error.message())));
        const tcp::endpoint where = found.begin()->endpoint();
        if (!allowed(where))
            return badInput(
                fmt::format("refusing to listen on {}: {}", hostPortText(host, port), insecureRefusal(where)));
        auto acceptor = std::make_unique<tcp::acceptor>(context);
        acceptor->open(where.protocol(), error);
        if (!error && where.address().is_loopback()) sendWithoutPauses(acceptor->native_handle());
        if (!error) acceptor->set_option(tcp::acceptor::reuse_address(true), error);
        if (!error) acceptor->bind(where, error);
        if (!error) acceptor->listen(boost::asio::socket_base::max_listen_connections, error);
        if (error)
            return failure(
                fmt::format("cannot listen on {}: {}", hostPortText(host, port), lowerFirst(error.message())));
        const std::uint16_t bound = acceptor->local_endpoint(error).port();
        boost::asio::post(context, [this, &one = *acceptor] { accept(one); });
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
        const std::uint64_t id = nextResolver++;
        auto& resolver = resolvers[id] = std::make_unique<tcp::resolver>(context);
        const std::uint64_t tag = action.tag;
        resolver->async_resolve(
            action.host, std::to_string(action.port),
            [this, id, tag](error_code error, tcp::resolver::results_type found) {
                resolvers.erase(id);
                if (error == boost::asio::error::operation_aborted) return;
                if (error)
                    return loop.dialFailed(
                        tag, failure("the host's address cannot be found (" + lowerFirst(error.message()) + ")"));
                std::vector<tcp::endpoint> addresses;
                for (const auto& entry : found) addresses.push_back(entry.endpoint());
                connectNext(std::move(addresses), 0, tag, failure("no address"));
            });
    }

    void connectNext(std::vector<tcp::endpoint> addresses, std::size_t index, std::uint64_t tag, Error reason) {
        while (index < addresses.size() && !allowed(addresses[index])) reason = badInput(insecureRefusal(addresses[index++]));
        if (index >= addresses.size()) return loop.dialFailed(tag, reason);
        auto socket = std::make_shared<tcp::socket>(context);
        const tcp::endpoint address = addresses[index];
        if (address.address().is_loopback()) {
            error_code ignored;  // connecting opens it, too
            socket->open(address.protocol(), ignored);
            if (socket->is_open()) sendWithoutPauses(socket->native_handle());
        }
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

    void add(tcp::socket socket, std::uint64_t tag) {
        error_code error;
        const int descriptor = socket.release(error);
        if (!error) loop.adopt(descriptor, tag);
    }
};

AsioPump::AsioPump(protocol::Endpoint& endpoint, bool insecureLan)
    : _implementation(std::make_unique<Implementation>(endpoint, insecureLan)) {}

AsioPump::~AsioPump() = default;

Result<std::uint16_t> AsioPump::listen(const std::string& host, std::uint16_t port) {
    return _implementation->listen(host, port);
}

void AsioPump::onTurn(std::function<void()> hook) {
    _implementation->loop.onTurn(std::move(hook));
}

void AsioPump::run() {
    _implementation->thread = std::thread([this] { _implementation->context.run(); });
    _implementation->loop.run();
}

void AsioPump::stop() {
    _implementation->loop.stop();
}

void AsioPump::post(std::function<void()> function) {
    _implementation->loop.post(std::move(function));
}

void AsioPump::enter(const std::function<void()>& function) {
    _implementation->loop.enter(function);
}

bool AsioPump::wait(const std::function<bool()>& condition, Duration limit) {
    return _implementation->loop.wait(condition, limit);
}

}  // namespace umbriel::net
