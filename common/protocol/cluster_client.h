#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "common/protocol/bulk_transfer.h"
#include "common/protocol/digest_comparison.h"
#include "common/protocol/clock_estimate.h"
#include "common/protocol/endpoint.h"
#include "common/protocol/frame_history.h"
#include "common/protocol/frame_pacing.h"
#include "common/protocol/job_port.h"
#include "common/protocol/linked_endpoint.h"
#include "common/protocol/swap_skew.h"
#include "common/wire/messages.h"

namespace umbriel::protocol {

// One server of the wall, as the client expects it.
struct RemoteServer {
    std::string name;  // what it must call itself; empty: whatever it does
    std::string host;  // empty: it dials us, again and again until it is welcome
    std::uint16_t port = 0;
    std::vector<TileAssignment> tiles;
};

// Who the client is, which servers it has, and how long it waits for what.
struct ClusterClientOptions {
    wire::Hello identity;     // name, build, type signature; role and channel are set here
    wire::Token token;        // 128 random bits
    std::uint32_t epoch = 1;  // of the first session with every server; later ones count up
    LinkOptions link;
    Duration connectTimeout = std::chrono::seconds(5);
    Duration redialAfter = std::chrono::milliseconds(250);  // while connecting
    Duration frameTimeout{0};  // 0: none; else a frame that takes longer is an error, whatever the policy
    FailurePolicy policy = FailurePolicy::Wait;
    int latency = 0;               // frames that may be under way when a request is over: 0 or 1
    bool startIncomplete = false;  // not under Wait: start with the servers that connect in time, others join later
    // After a loss: from least, doubled up to most, half of it random. A server that comes back is to be whole within
    // 2 s, which the longest pause and one futile handshake must leave room for.
    Duration rejoinLeast = std::chrono::milliseconds(100);
    Duration rejoinMost = std::chrono::milliseconds(800);
    Duration rejoinHandshake = std::chrono::milliseconds(600);
    // Changes kept for servers that are behind; beyond that they need a snapshot.
    std::uint64_t historyBytes = std::uint64_t{64} << 20;
    std::size_t historyFrames = 256;
    // A server whose digest differs is asked what differs, for so long at most, before it gets a snapshot; 0: not.
    // Not under Wait, where the caller asks. The caller then gives digests when wantsDigests() asks for them.
    Duration compareWithin{0};
    PixelSize wall;
    std::vector<RemoteServer> servers;
};

// A whole scene for a server that is behind: parts as encodeChanges makes them, and the contents they refer to.
struct SceneSnapshot {
    std::vector<wire::Bytes> parts;
    std::map<Hash128, MultiStorage> blobs;
};

// A frame as the client hands it to the protocol. time: seconds.
struct OutgoingFrame {
    std::uint64_t number = 0;  // counts from 1 without gaps
    bool wantPixels = false;
    bool wantCost = false;     // outcomes say what the frame cost each server
    bool fromNothing = false;  // the changes are a snapshot, for every server
    double time = 0.0;
    wire::Bytes views;                      // encodeViews
    std::vector<wire::Bytes> changes;       // encodeChanges' parts, each at most kChunkBytes
    std::map<Hash128, MultiStorage> blobs;  // what the changes refer to; servers fetch what they lack
    std::optional<SceneSnapshot> snapshot;  // the scene after this frame, when wantsSnapshot() asked for it
    std::uint64_t digest = 0;               // of the state that every server must have
    std::shared_ptr<const StateDigest> digests;  // all of it, when wantsDigests() asked for it
};

// What one server did for one frame. bytes: sent to it in all; viewBytes: of these, views and fits.
struct ServerOutcome {
    wire::Ready ready;
    std::uint64_t bytes = 0;
    std::uint64_t viewBytes = 0;
    Duration wait{};         // from ready until the swap left for it
    bool connected = false;  // when the frame was over
    bool shown = false;      // it was told to show this frame
    std::vector<TilePixels> tiles;
};

// What happened to a server, for the log: each thing once.
struct ServerIncident {
    enum class Kind {
        Late,       // it missed a frame's deadline; its tile holds its last picture
        Lost,       // its session ended
        Refused,    // it cannot be reached again, with the reason; once for every reason
        Differing,  // its state is not the client's; it gets a snapshot
        Compared,   // what differs, after Differing; no difference: it is not known
        Rejoined    // it shows what the others show
    };
    Kind kind = Kind::Lost;
    std::size_t server = 0;
    std::string text;
    std::optional<DigestDifference> difference;  // Compared
};

// The client's side of the protocol: reaches every server, hands out tiles, and runs frames in step: a frame is swapped
// when every server has drawn it from the state whose digest the client has, or when those that have not are late by
// the policy's deadline. A late server goes on from where it is: it gets what changed meanwhile when it has answered. A
// lost one is reached again and starts from a snapshot. Neither is waited for before it has answered one frame in time,
// so it holds the others up once. One request at a time: it is over when isBusy() is false again.
class ClusterClient final : public LinkedEndpoint {
 public:
    ClusterClient(ClusterClientOptions options, TimePoint now);

    void opened(ConnectionId connection, std::uint64_t dialTag, TimePoint now) override;
    void dialFailed(std::uint64_t dialTag, const Error& reason, TimePoint now) override;
    void written(ConnectionId connection, TimePoint now) override;
    void advance(TimePoint now) override;
    TimePoint deadline() const override;

    // Connecting counts as the first request.
    bool isBusy() const {
        return !_error && (_phase != Phase::Idle ||
                           _running.size() > (_finishing ? 0 : static_cast<std::size_t>(_options.latency)));
    }
    // What ended the cluster: a lost or refusing server (under Wait, or while connecting). Nothing works after it.
    const std::optional<Error>& error() const { return _error; }
    // Names of the servers that the running request still waits for.
    std::vector<std::string> waitingFor() const;
    // Every server shows what the others show, as far as is known here.
    bool isWhole() const;
    // A server is connected and can only go on from a snapshot: the next frame should bring one.
    bool wantsSnapshot() const;
    // A server is to be asked what differs: the next frame should bring digests of its state.
    bool wantsDigests() const;
    // Since the last call; at most a few hundred are kept.
    std::vector<ServerIncident> takeIncidents() { return std::exchange(_incidents, {}); }
    // Of changes kept for servers that are behind.
    std::uint64_t historyBytes() const { return _history.bytes(); }

    // Between requests, with no frame under way: another wall, cut into other tiles, for each server in the order of
    // the options.
    void assign(PixelSize wall, std::vector<std::vector<TileAssignment>> tiles);
    // Over when at most `latency` frames are under way.
    void beginFrame(OutgoingFrame frame, TimePoint now);
    // Over when no frame is under way.
    void finishFrames() { _finishing = true; }
    // A frame that is over.
    struct Finished {
        std::uint64_t number = 0;
        Duration took{};                      // from its request until it was over
        std::vector<ServerOutcome> servers;   // in the order of the options
        std::optional<std::size_t> mismatch;  // the first server whose digest differs; under Wait nobody showed it then
    };
    // Frames that are over since the last call, oldest first; the last few when nobody asks.
    std::vector<Finished> takeFinished();
    // Of the last frame that is over. Taken once.
    std::vector<ServerOutcome> takeOutcome();
    std::optional<std::size_t> mismatch() const;

    // Requests with no frame under way. A server that is lost meanwhile leaves an empty answer.
    void beginDigestQuery(std::size_t server, const wire::DigestQuery& query);
    wire::DigestReply takeDigests() { return std::move(_digests); }
    void beginExplain();
    // One text per server.
    std::vector<std::string> takeExplanations();

    // Jobs (job_port.h), at any time beside frames: nothing here waits for a job. What is meant for a session that has
    // ended is dropped: its end was announced.
    std::uint32_t provideBlobs(std::vector<wire::Blob> blobs);
    void finishJobs();
    void offerJob(JobPeer peer, const JobRequest& request);
    void cancelJob(JobPeer peer, std::uint64_t job, std::uint32_t attempt);
    void fetchResult(JobPeer peer, const wire::BlobRef& result);
    // Since the last call; kept from provideBlobs() until finishJobs(). A server that fills it with more than anyone asked
    // for loses its session.
    std::vector<JobNews> takeJobNews() { return std::exchange(_jobNews, {}); }
    bool hasJobNews() const { return !_jobNews.empty(); }

    // Asks every server for its time and for what it has shown; they answer within a round trip, or are lost.
    void askForClocks(TimePoint now);
    bool waitsForClocks() const;
    SwapSkew::Summary swapSkew() const { return _skew.summary(); }

    // Null while it is not connected.
    const wire::Hello* serverHello(std::size_t server) const;
    std::size_t serverCount() const { return _servers.size(); }

    // Says goodbye to all; the endpoint is finished when it has no connections.
    void leave(const std::string& reason);

 private:
    enum class Phase { Connecting, Idle, Digests, Explaining };

    // Which server a peer is; a peer's tag says it.
    struct Place {
        std::size_t server = 0;
        bool bulk = false;
    };
    static std::uint64_t tagOf(Place place) { return 1 + 2 * place.server + (place.bulk ? 1 : 0); }
    static Place placeOf(std::uint64_t tag) { return {static_cast<std::size_t>((tag - 1) / 2), (tag - 1) % 2 == 1}; }
    // A frame that was sent to a server and is not ready there.
    struct Sent {
        std::uint64_t number = 0;
        std::uint64_t digest = 0;
        TimePoint at;
        FrameHistory::Frames changes;  // for the blobs it may ask for
    };
    // A server whose digest differed is being asked what differs.
    struct Comparing {
        TimePoint since;
        std::uint64_t frame = 0;  // of which the client knows all digests; 0: no such frame was sent yet
        std::optional<DigestComparison> digests;
    };
    // What one session with a server knows; a new session starts with a new one.
    struct Session {
        ConnectionId control = 0;
        ConnectionId bulk = 0;
        std::uint32_t epoch = 0;
        bool controlOpen = false;
        bool bulkOpen = false;
        bool needsSnapshot = true;
        bool waitedFor = false;        // frames wait for it
        std::uint64_t upTo = 0;        // all changes up to this frame were sent
        std::uint64_t pixelsUpTo = 0;  // the last frame whose pixels were asked for
        bool owesPixels = false;       // those it was waited for came too late: not again before it has caught up
        int mismatches = 0;            // digests in a row that differ
        std::optional<Comparing> comparing;  // it is sent nothing else meanwhile
        wire::Bytes views;             // as it has them
        std::optional<double> time;
        std::uint64_t bytesBefore = 0;  // link counters when the last frame was over
        std::deque<Sent> sent;
        std::deque<std::pair<wire::MessageType, std::shared_ptr<const wire::Bytes>>> outbox;  // for control
        BulkSender sender;
        std::unique_ptr<BlobReceiver> results = std::make_unique<BlobReceiver>();  // of jobs
        std::uint32_t number = 0;  // JobPeer::session, once connected
        ClockEstimate clock;
        bool asked = false;  // for its time, and has not answered
        bool connected() const { return controlOpen && bulkOpen; }
    };
    struct Server {
        RemoteServer remote;
        Session session;
        std::uint32_t sessions = 0;  // dialled so far
        std::string knownName;       // what it called itself last
        bool dialling = false;       // a control connection
        std::string lastFailure;     // of dialling
        std::optional<TimePoint> redialAt;
        bool redialBulk = false;
        int failures = 0;   // since it was whole
        bool whole = true;  // shows what the others show
        bool lost = false;  // after it was connected once, or at the start
        std::optional<std::string> explanation;
    };
    // What a running frame is to one server.
    struct Part {
        bool sent = false;
        bool waitedFor = false;
        bool ready = false;
        bool differs = false;
        bool tilesDone = true;
        TimePoint readyAt;
        TileReceiver tiles;
        ServerOutcome outcome;
    };
    // The frame message, encoded once for all servers that have the same views and time.
    struct EncodedFrame {
        bool fromNothing;
        bool withViews;
        bool withTime;
        std::shared_ptr<const wire::Bytes> payload;
    };
    struct Running {
        OutgoingFrame frame;  // without changes
        TimePoint start;
        std::shared_ptr<const FrameChanges> delta;
        std::shared_ptr<const FrameChanges> snapshot;
        std::vector<EncodedFrame> encoded;
        std::vector<Part> parts;
        bool swapped = false;
        std::optional<TimePoint> due;  // set when half of those that are waited for are done
        std::optional<std::size_t> mismatch;
    };

    // Connections (cluster_client.cpp)
    void greeted(ConnectionId connection, Peer& peer, TimePoint now) override;
    void linkOpen(ConnectionId connection, Peer& peer, TimePoint now) override;
    void message(ConnectionId connection, Peer& peer, wire::MessageType type, std::span<const std::byte> payload,
                 TimePoint now) override;
    void more(ConnectionId connection, Peer& peer, std::span<const std::byte> bytes, TimePoint now) override;
    std::size_t roomForMore(ConnectionId connection, const Peer& peer, std::span<std::span<std::byte>> places) override;
    void morePlaced(ConnectionId connection, Peer& peer, std::size_t count, TimePoint now) override;
    void linkClosed(ConnectionId connection, Peer& peer, const std::string& reason, TimePoint now) override;
    void handled(TimePoint now) override { progress(now); }
    // For one that dialled us: whose place it takes, or why it has none.
    Result<Place> placeFor(const wire::Hello& hello) const;
    void connectingTimedOut();
    void dialServer(std::size_t server, bool bulk);
    // The session is over: an error of the whole under Wait and while connecting, else the server is reached again.
    void lose(std::size_t server, const std::string& reason, TimePoint now);
    void redialLater(Server& server, TimePoint now);
    bool endsTheCluster() const {
        return _options.policy == FailurePolicy::Wait || (_phase == Phase::Connecting && !_options.startIncomplete);
    }
    std::uint64_t bytesSent(const Server& server) const;
    void report(ServerIncident::Kind kind, std::size_t server, std::string text,
                std::optional<DigestDifference> difference = std::nullopt);
    void fail(std::string message);
    void fail(Error error);
    std::string textOf(std::size_t server) const;

    // Frames (cluster_frames.cpp)
    Result<void> answer(std::size_t server, wire::MessageType type, std::span<const std::byte> payload, TimePoint now);
    Result<void> ready(std::size_t server, const wire::Ready& ready, TimePoint now);
    Result<void> tileData(std::size_t server, const wire::TileData& data);
    void sendFrame(std::size_t server, Running& running, TimePoint now);
    // Jobs (cluster_jobs.cpp)
    Result<void> jobMessage(std::size_t server, wire::MessageType type, std::span<const std::byte> payload);
    void sessionBegun(std::size_t server);
    void sessionEnded(std::size_t server, const Session& session, const std::string& reason);
    Result<void> resultReceived(std::size_t server, Result<std::optional<wire::Blob>> blob);
    Result<void> tell(JobNews news);
    void tellOfJobs(JobNews news);
    // The control link of that session; null when it has ended.
    Link* jobLink(JobPeer peer);

    // Sends what remains of change lists and frames, as far as the queue takes it.
    void feed(Server& server);
    std::shared_ptr<const wire::Bytes> frameMessage(Running& running, bool fromNothing, bool withViews, bool withTime);
    // Goes as far as it can with the frames under way.
    void progress(TimePoint now);
    bool swapWhenReady(Running& running, TimePoint now);
    bool tilesOver(Running& running, TimePoint now);
    void swap(std::size_t server, std::uint64_t frame);
    void finishFrame(Running& running, TimePoint now);
    // With so many of those that are waited for done: sets the running frame's deadline, says whether it is over.
    bool isDue(Running& running, std::size_t done, std::size_t of, TimePoint now);
    std::optional<TimePoint> dueAt() const;
    // Why the server does not take these changes; empty when it does.
    std::string beyondLimits(std::size_t server, const FrameHistory::Frames& changes) const;
    void heartbeat(std::size_t server, const wire::Heartbeat& heartbeat, TimePoint now);
    std::optional<Duration> allowanceOf(const Running& running) const;
    void becameLate(std::size_t server, std::uint64_t frame);
    Result<void> differs(std::size_t server, const Sent& sent, TimePoint now);
    void compared(std::size_t server, std::optional<DigestDifference> difference, std::string_view text);

    ClusterClientOptions _options;
    std::vector<Server> _servers;
    std::optional<Error> _error;
    Phase _phase = Phase::Connecting;
    TimePoint _phaseStart;
    std::uint32_t _accepted =
        0;  // connections of servers that dial us: each would be a newer session than those before
    std::deque<Running> _running;
    std::deque<Finished> _finished;
    bool _finishing = false;
    std::uint64_t _lastSwapped = 0;
    FrameHistory _history;
    FramePacing _pacing;
    SwapSkew _skew;
    std::vector<ServerIncident> _incidents;
    std::uint64_t _random;
    wire::DigestReply _digests;
    std::size_t _digestServer = 0;
    std::map<Hash128, MultiStorage> _jobBlobs;
    std::vector<JobNews> _jobNews;
    bool _hasJobs = false;
    std::uint32_t _jobSeries = 0;
    std::uint32_t _connectedSessions = 0;
};

}  // namespace umbriel::protocol
