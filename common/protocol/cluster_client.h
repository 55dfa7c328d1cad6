#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/protocol/bulk_transfer.h"
#include "common/protocol/endpoint.h"
#include "common/protocol/link.h"
#include "common/wire/messages.h"

namespace umbriel::protocol {

struct RemoteServer {
    std::string name;             // what it must call itself; empty: whatever it does
    std::string host;             // empty: it dials us
    std::uint16_t port = 0;
    std::vector<TileAssignment> tiles;
};

struct ClusterClientOptions {
    wire::Hello identity;         // name, build, type signature; role and channel are set here
    wire::Token token;            // 128 random bits
    std::uint32_t epoch = 1;
    LinkOptions link;
    Duration connectTimeout = std::chrono::seconds(5);
    Duration redialAfter = std::chrono::milliseconds(250);
    Duration frameTimeout{0};     // 0: wait while heartbeats come
    PixelSize wall;
    std::vector<RemoteServer> servers;
};

struct OutgoingFrame {
    std::uint64_t number = 0;
    bool wantPixels = false;
    bool fromNothing = false;
    double time = 0.0;
    wire::Bytes views;                                  // encodeViews
    std::vector<wire::Bytes> changes;                   // encodeChanges' parts, each at most kChunkBytes
    std::map<Hash128, MultiStorage> blobs;              // what the changes refer to; servers fetch what they lack
    std::uint64_t digest = 0;                           // of the state that every server must have
};

struct ServerOutcome {
    wire::Ready ready;
    std::uint64_t bytes = 0;
    std::uint64_t viewBytes = 0;
    Duration wait{};  // from ready until the swap left for it
    std::vector<TilePixels> tiles;
};

// The client's side of the protocol: reaches every server, hands out tiles, and runs frames in lock-step: a frame is
// swapped when every server has drawn it from the state whose digest the client has. One request at a time: it is over
// when isBusy() is false again.
class ClusterClient final : public Endpoint {
 public:
    ClusterClient(ClusterClientOptions options, TimePoint now);

    void opened(ConnectionId connection, std::uint64_t dialTag, TimePoint now) override;
    void dialFailed(std::uint64_t dialTag, const Error& reason, TimePoint now) override;
    void received(ConnectionId connection, std::span<const std::byte> bytes, TimePoint now) override;
    void written(ConnectionId connection, TimePoint now) override;
    void closed(ConnectionId connection, const std::string& reason, TimePoint now) override;
    void advance(TimePoint now) override;
    TimePoint deadline() const override;
    std::optional<Action> nextAction() override;
    SendQueue* output(ConnectionId connection) override;

    // Connecting counts as the first request.
    bool isBusy() const { return _phase != Phase::Idle && !_error; }
    // What ended the cluster: a lost or refusing server, a broken protocol. Nothing works after it.
    const std::optional<Error>& error() const { return _error; }
    // Names of the servers that the running request still waits for.
    std::vector<std::string> waitingFor() const;

    // Between requests: another wall, cut into other tiles, for each server in the order of the options.
    void assign(PixelSize wall, std::vector<std::vector<TileAssignment>> tiles);
    void beginFrame(OutgoingFrame frame, TimePoint now);
    // After a frame: what the servers did, in the order of the options. Taken once.
    std::vector<ServerOutcome> takeOutcome();
    // After a frame: the first server whose digest differs; the frame was not swapped then.
    std::optional<std::size_t> mismatch() const { return _mismatch; }

    void beginDigestQuery(std::size_t server, const wire::DigestQuery& query);
    wire::DigestReply takeDigests() { return std::move(_digests); }
    void beginExplain();
    // One text per server.
    std::vector<std::string> takeExplanations();

    const wire::Hello& serverHello(std::size_t server) const;
    std::size_t serverCount() const { return _servers.size(); }

    // Says goodbye to all; the endpoint is finished when it has no connections.
    void leave(const std::string& reason);
    bool hasConnections() const { return !_peers.empty(); }

 private:
    enum class Phase { Connecting, Idle, Drawing, Digests, Explaining };

    struct Peer {
        std::unique_ptr<Link> link;
        std::size_t server = 0;
        bool known = false;  // which server it is
        bool bulk = false;
        bool closing = false;
    };
    struct Server {
        RemoteServer remote;
        ConnectionId control = 0;
        ConnectionId bulk = 0;
        bool controlOpen = false;
        bool bulkOpen = false;
        std::string lastFailure;           // of dialling
        std::optional<TimePoint> redialAt;
        bool redialBulk = false;
        wire::Bytes views;                 // as it has them
        std::optional<double> time;
        std::uint64_t bytesBefore = 0;     // link counters when the last frame was over
        bool ready = false;
        bool tilesDone = true;
        TimePoint readyAt;
        ServerOutcome outcome;
        bool withViews = false;            // the frame being sent to it has them
        bool withTime = false;
        std::size_t nextPart = 0;          // of the change list
        bool frameSent = true;
        BulkSender sender;
        TileReceiver tiles;
        std::optional<std::string> explanation;
    };

    void drain(ConnectionId connection, TimePoint now);
    void greeted(ConnectionId connection, Peer& peer);
    void linkOpen(ConnectionId connection, Peer& peer);
    Result<void> message(Server& server, wire::MessageType type, std::span<const std::byte> payload, TimePoint now);
    // Sends what remains of the change list and then the frame, as far as the queue takes it.
    void feed(Server& server);
    std::shared_ptr<const wire::Bytes> frameMessage(bool withViews, bool withTime);
    void frameProgress(TimePoint now);
    std::uint64_t bytesSent(const Server& server) const;
    void dial(std::size_t server, bool bulk);
    void fail(std::string message);
    void fail(Error error);
    void drop(ConnectionId connection);
    Link* link(ConnectionId connection);
    std::string textOf(std::size_t server) const;
    std::string textOf(const Server& server) const { return textOf(static_cast<std::size_t>(&server - _servers.data())); }

    ClusterClientOptions _options;
    std::vector<Server> _servers;
    std::map<ConnectionId, Peer> _peers;
    std::deque<Action> _actions;
    std::optional<Error> _error;
    Phase _phase = Phase::Connecting;
    TimePoint _phaseStart;
    OutgoingFrame _frame;
    bool _swapped = false;
    std::optional<std::size_t> _mismatch;
    // The frame message, encoded once for all servers that have the same views and time.
    struct EncodedFrame {
        bool withViews;
        bool withTime;
        std::shared_ptr<const wire::Bytes> payload;
    };
    std::vector<EncodedFrame> _encoded;
    std::vector<std::shared_ptr<const wire::Bytes>> _changeParts;  // all but one that travels in the frame message
    std::span<const std::byte> _inlineChanges;
    wire::DigestReply _digests;
    std::size_t _digestServer = 0;
};

}  // namespace umbriel::protocol
