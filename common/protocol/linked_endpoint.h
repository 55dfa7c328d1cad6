#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>

#include "common/protocol/endpoint.h"
#include "common/protocol/link.h"

namespace umbriel::protocol {

// What the two sides of the protocol have in common: links by connection, their bytes and their ends, and the actions
// for the pump. The sides say what a link's events mean.
class LinkedEndpoint : public Endpoint {
 public:
    void received(ConnectionId connection, std::span<const std::byte> bytes, TimePoint now) final;
    void closed(ConnectionId connection, const std::string& reason, TimePoint now) final;
    std::size_t room(ConnectionId connection, std::span<std::span<std::byte>> places) final;
    void placed(ConnectionId connection, std::size_t count, TimePoint now) final;
    std::optional<Action> nextAction() final;
    SendQueue* output(ConnectionId connection) final;
    std::optional<ConnectionId> nextOutput() final;

    bool hasConnections() const { return !_peers.empty(); }

 protected:
    struct Peer {
        Peer(const LinkOptions& options, wire::Hello mine, std::uint64_t t, TimePoint now)
            : link(options, std::move(mine), now), tag(t) {}
        Link link;
        std::uint64_t tag;     // of the dial; 0: it dialled us, and the side may give it one of its own
        bool closing = false;  // the pump was asked to close it
    };

    // Its hello has come: the link is to be accepted or refused.
    virtual void greeted(ConnectionId connection, Peer& peer, TimePoint now) = 0;
    virtual void linkOpen(ConnectionId connection, Peer& peer, TimePoint now) = 0;
    virtual void message(ConnectionId connection, Peer& peer, wire::MessageType type,
                         std::span<const std::byte> payload, TimePoint now) = 0;
    // The BlobData before goes on.
    virtual void more(ConnectionId connection, Peer& peer, std::span<const std::byte> bytes, TimePoint now) = 0;
    // Where it goes on, if that is known, and so many bytes that lie there now.
    virtual std::size_t roomForMore(ConnectionId connection, const Peer& peer,
                                    std::span<std::span<std::byte>> places) = 0;
    virtual void morePlaced(ConnectionId connection, Peer& peer, std::size_t count, TimePoint now) = 0;
    // The link has closed, whoever closed it, and is dropped already.
    virtual void linkClosed(ConnectionId connection, Peer& peer, const std::string& reason, TimePoint now) = 0;
    // All that came of some bytes, or of a connection's end, was handled.
    virtual void handled(TimePoint) {}

    // Says hello on a new connection.
    void adopt(ConnectionId connection, const LinkOptions& options, wire::Hello mine, std::uint64_t tag, TimePoint now);
    // Whether there may be one connection more than `most` are: where all places are taken, the stranger that has been
    // there for longest without a hello gives its place up, so that silent ones cannot keep others out.
    bool admits(std::size_t most);
    // Closes a connection that never had a link.
    void decline(ConnectionId connection);
    // Closes it after what is queued was written. Once; a connection that is unknown is gone already.
    void drop(ConnectionId connection);
    // Says goodbye on every link.
    void dropAll(const std::string& reason);
    void dial(std::uint64_t tag, const std::string& host, std::uint16_t port);

    // Null when it is unknown.
    Peer* peer(ConnectionId connection);
    const Peer* peer(ConnectionId connection) const;
    Link* link(ConnectionId connection);

    void advanceLinks(TimePoint now);
    // Not later than any link's: found anew when it is reached, for links mostly put off theirs.
    TimePoint linkDeadline() const { return _linkDeadline; }

 private:
    void drain(ConnectionId connection, Peer& peer, TimePoint now);

    std::map<ConnectionId, Peer> _peers;
    std::map<std::uint64_t, std::string> _dialled;  // by tag, the last: HOST:PORT
    std::deque<Action> _actions;
    std::deque<ConnectionId> _outputs;
    TimePoint _linkDeadline = TimePoint::max();
};

}  // namespace umbriel::protocol
