#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/protocol/send_queue.h"

namespace umbriel::protocol {

// Names one connection of an endpoint; given by the pump, never reused.
using ConnectionId = std::uint64_t;

// What an endpoint wants from its pump.
struct Action {
    enum class Kind { Dial, Close };
    Kind kind = Kind::Close;
    ConnectionId connection = 0;  // Close: after what is queued was written, for a second at most
    std::uint64_t tag = 0;        // Dial: returned with the connection or the failure; never 0
    std::string host;
    std::uint16_t port = 0;
};

// One program's side of the protocol: a state machine over any number of connections, without sockets, threads or a
// clock of its own. A pump (net/asio_pump.h, net/memory_pump.h) calls it from one thread at a time, after every call
// takes its actions, and writes what its queues hold.
class Endpoint {
 public:
    virtual ~Endpoint() = default;

    // A connection exists. dialTag: of the Dial it answers; 0: a peer dialled us.
    virtual void opened(ConnectionId connection, std::uint64_t dialTag, TimePoint now) = 0;
    // The reason is bad input when dialling again can never help (an address that is not allowed), else a failure.
    virtual void dialFailed(std::uint64_t dialTag, const Error& reason, TimePoint now) = 0;
    virtual void received(ConnectionId connection, std::span<const std::byte> bytes, TimePoint now) = 0;
    // Where the next bytes of this connection are to lie in the end: a pump may put them there, one place after the
    // other, and say so, instead of giving them to received(). Returns how many places were set; valid until the next
    // call. What comes behind the last place goes to received().
    virtual std::size_t room(ConnectionId, std::span<std::span<std::byte>>) { return 0; }
    virtual void placed(ConnectionId, std::size_t, TimePoint) {}
    // Some of the connection's queue was written.
    virtual void written(ConnectionId connection, TimePoint now) = 0;
    // The connection is gone, whoever ended it. Called once for every connection that was opened.
    virtual void closed(ConnectionId connection, const std::string& reason, TimePoint now) = 0;

    // Time has reached the deadline. Earlier calls do no harm.
    virtual void advance(TimePoint now) = 0;
    // Not later than anything has to happen without a call.
    virtual TimePoint deadline() const = 0;

    virtual std::optional<Action> nextAction() = 0;
    // Null when the endpoint knows no such connection.
    virtual SendQueue* output(ConnectionId connection) = 0;
    // A connection whose queue has grown since it was named last, so that a pump need not look at all of them.
    virtual std::optional<ConnectionId> nextOutput() = 0;
};

}  // namespace umbriel::protocol
