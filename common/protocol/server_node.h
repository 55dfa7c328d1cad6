#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/protocol/bulk_transfer.h"
#include "common/protocol/linked_endpoint.h"
#include "common/wire/blob.h"
#include "common/wire/messages.h"

namespace umbriel::protocol {

// What a render server's program is told.
namespace server_event {
// A client has this server from now on: its name.
struct SessionStarted {
    std::string client;
};
// It has left, or was lost: why, for people.
struct SessionEnded {
    std::string reason;
};
// The tiles to draw from the next frame on, instead of those before.
struct Assigned {
    PixelSize wall;
    std::vector<TileAssignment> tiles;
};
// The client that is to be dialled has no session for us: once for every reason. It is dialled again, unless the reason
// is bad input.
struct ClientUnreachable {
    Error reason;
};
// Draw, after applying the parts of a change list (change_codec.h), which nobody has looked at yet.
struct FrameRequested {
    std::uint64_t number = 0;
    bool wantPixels = false;
    bool wantCost = false;  // in Ready
    bool fromNothing = false;
    double time = 0.0;
    std::optional<WallViews> views;  // when they changed
    std::vector<wire::Bytes> changes;
};
// Show this frame, which was ready.
struct SwapRequested {
    std::uint64_t frame = 0;
};
// A content that was wanted, whole and of the hash it was wanted by.
struct BlobArrived {
    wire::Blob blob;
};
// The client wants to know what differs: answer with digests of this part of the state.
struct DigestAsked {
    wire::DigestQuery query;
};
struct ExplainAsked {};
// Work beside drawing (architecture.md). lease: without a sign of life for so long it is given to another server.
struct JobOffered {
    std::uint64_t job = 0;
    std::uint32_t attempt = 0;
    Duration lease{};
    std::string kind;
    wire::Bytes payload;
    std::vector<wire::BlobRef> blobs;  // that it needs; wantBlobs() those that are not here
};
// Nobody waits for this attempt any more.
struct JobCancelled {
    std::uint64_t job = 0;
    std::uint32_t attempt = 0;
};
}  // namespace server_event

using ServerEvent = std::variant<server_event::SessionStarted, server_event::SessionEnded, server_event::Assigned,
                                 server_event::ClientUnreachable, server_event::FrameRequested,
                                 server_event::SwapRequested, server_event::BlobArrived, server_event::DigestAsked,
                                 server_event::ExplainAsked, server_event::JobOffered, server_event::JobCancelled>;

// Who the server is, and how it finds its client: it waits, or dials.
struct ServerNodeOptions {
    wire::Hello identity;  // name, build, type signature, GL and CPU; role and channel are set here
    LinkOptions link;
    std::string dialHost;  // not empty: reach the client there instead of waiting for it
    std::uint16_t dialPort = 0;
    Duration redialAfter = std::chrono::milliseconds(500);
    // A client from which nothing has come for so long keeps its session as long as link.heartbeatLoss allows, but
    // another one may take its place.
    Duration clientSilence = std::chrono::seconds(2);
    std::size_t maxConnections = 64;  // strangers included; beyond, silent ones give their places up
};

// A render server's side of the protocol: accepts one client at a time and turns its messages into events. The same
// client with a higher epoch fences its old session; another one is refused by name while the first is alive.
class ServerNode final : public LinkedEndpoint {
 public:
    // So many frames may be requested and not ready, and so many ready ones may still be swapped; of more, the oldest
    // was given up by the client.
    static constexpr std::size_t kMaxFramesUnderWay = 2;

    ServerNode(ServerNodeOptions options, TimePoint now);

    void opened(ConnectionId connection, std::uint64_t dialTag, TimePoint now) override;
    void dialFailed(std::uint64_t dialTag, const Error& reason, TimePoint now) override;
    void written(ConnectionId connection, TimePoint now) override;
    void advance(TimePoint now) override;
    TimePoint deadline() const override;

    std::optional<ServerEvent> nextEvent();
    bool hasSession() const { return _session.has_value(); }

    // Answers; without a session they do nothing. frame is the number that was requested.
    void sendReady(std::uint64_t frame, wire::Ready ready);
    // The frame that was to be swapped is on the screen since then.
    void reportSwap(std::uint64_t frame, TimePoint at);
    void sendFailed(std::uint64_t frame, const std::string& text);
    // Blobs arrive as events. What is on its way already is not asked for again.
    void wantBlobs(const std::vector<wire::BlobRef>& blobs);
    void sendTiles(std::uint64_t frame, std::vector<TilePixels> tiles);
    void sendDigests(const wire::DigestReply& reply);
    void sendExplanation(const std::string& text);
    void sendJobLease(const wire::JobLease& lease);
    // The result waits here until the client fetches it, cancels the job or ends the session.
    void sendJobDone(wire::JobDone done, wire::Bytes result);

    // The program's own end of the session: what the client sent cannot be used, or the program is leaving.
    void endSession(const std::string& reason);
    // Ends the session, closes every connection and opens no other.
    void leave(const std::string& reason);

 private:
    struct Session {
        wire::Token token;
        std::uint32_t epoch = 0;
        std::string client;
        ConnectionId control = 0;
        ConnectionId bulk = 0;  // 0: not there yet
        bool started = false;
        bool assigned = false;
        bool hasViews = false;
        std::uint64_t lastFrame = 0;
        std::optional<double> time;
        std::deque<std::uint64_t> drawing;  // requested, not ready
        std::deque<std::uint64_t> shown;    // ready, not swapped
        std::vector<wire::Bytes> changes;   // parts of the next frame's list
        std::size_t changeBytes = 0;
        BulkSender sender;
        BlobReceiver receiver;
        struct JobResult {
            std::uint64_t job = 0;
            std::uint32_t attempt = 0;
            MultiStorage content;
        };
        std::map<Hash128, JobResult> results;
    };

    void greeted(ConnectionId connection, Peer& peer, TimePoint now) override;
    void linkOpen(ConnectionId connection, Peer& peer, TimePoint now) override;
    void message(ConnectionId connection, Peer& peer, wire::MessageType type, std::span<const std::byte> payload,
                 TimePoint now) override;
    void more(ConnectionId connection, Peer& peer, std::span<const std::byte> bytes, TimePoint now) override;
    std::size_t roomForMore(ConnectionId connection, const Peer& peer, std::span<std::span<std::byte>> places) override;
    void morePlaced(ConnectionId connection, Peer& peer, std::size_t count, TimePoint now) override;
    void linkClosed(ConnectionId connection, Peer& peer, const std::string& reason, TimePoint now) override;
    // Why this hello is not acceptable; empty when it is. dialled: by us; the client cannot know then who does, and its
    // hello names its newest session.
    std::string objection(const wire::Hello& hello, bool bulk, bool dialled, TimePoint now) const;
    bool clientIsSilent(TimePoint now) const;
    Result<void> obey(wire::MessageType type, std::span<const std::byte> payload);
    Result<void> frame(std::span<const std::byte> payload);
    Result<void> blobReceived(Result<std::optional<wire::Blob>> blob);
    Result<void> addChanges(std::span<const std::byte> part);
    template <class Message>
    void send(const Message& message);
    void overflow();
    void ended(const std::string& reason);
    Link* control();
    void fillBulk();
    void unreachable(Error reason, TimePoint now);

    ServerNodeOptions _options;
    std::optional<Session> _session;
    std::deque<ServerEvent> _events;
    bool _leaving = false;
    bool _dialling = false;
    ConnectionId _dialledControl = 0;
    std::string _lastUnreachable;
    TimePoint _redialAt;
};

}  // namespace umbriel::protocol
