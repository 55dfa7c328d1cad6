#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/protocol/server_node.h"
#include "common/scene/aspect.h"
#include "common/scene/digest.h"
#include "common/wire/change_codec.h"
#include "tests/sim/probes.h"
#include "tests/sim/random.h"

namespace umbriel::sim {

// Mistakes that the simulation must find. They are in its own model of a server and of an application.
enum class Planted {
    None,
    StaleSession,        // server: a change list that an old session left is applied in the new one
    ReadyEarly,          // server: says ready before it has drawn, so that the swap comes too early
    NotEmptied,          // server: a snapshot is added to what an earlier session left
    ShowsAtOnce,         // server: shows a frame when it is drawn, without waiting for the others
    ShowsWhatIsDrawn,    // server: after a late frame it shows that one at the next swap
    IncompleteSnapshot,  // application: the snapshot lacks a container
    ForgottenChange,     // application: now and then a frame's changes are not sent
    DeadlineIgnored,     // client: waits for longer than the policy
    NoRedial             // client: lost servers are reached again much too late
};

// A render server without OpenGL on the virtual clock: the protocol's node, an aspect, a digest, drawing that takes
// time. What a session leaves behind and what reaches the next one is as in server/session.
class ModelServer final : public protocol::Endpoint {
 public:
    struct Observer {
        virtual ~Observer() = default;
        // It shows a frame. digest: of the state it was drawn from; none: it was not drawn.
        virtual void shows(std::size_t server, std::uint64_t frame, std::optional<std::uint64_t> digest) = 0;
        virtual void hit(Probe probe) = 0;
    };

    ModelServer(std::size_t index, const std::string& name, const TypeRegistry& types, Observer& observer,
                Planted planted, std::uint64_t seed, Duration leastDraw, Duration mostDraw, TimePoint now);

    void opened(protocol::ConnectionId connection, std::uint64_t tag, TimePoint now) override;
    void dialFailed(std::uint64_t tag, const Error& reason, TimePoint now) override;
    void received(protocol::ConnectionId connection, std::span<const std::byte> bytes, TimePoint now) override;
    void written(protocol::ConnectionId connection, TimePoint now) override;
    void closed(protocol::ConnectionId connection, const std::string& reason, TimePoint now) override;
    void advance(TimePoint now) override;
    TimePoint deadline() const override;
    std::optional<protocol::Action> nextAction() override { return _node.nextAction(); }
    protocol::SendQueue* output(protocol::ConnectionId connection) override { return _node.output(connection); }
    std::optional<protocol::ConnectionId> nextOutput() override { return _node.nextOutput(); }

    void setSlow(bool slow) { _slow = slow; }
    std::uint64_t shown() const { return _shown; }
    bool isDrawing() const { return _drawing.has_value(); }
    bool hasDrawn(std::uint64_t frame) const { return frame <= _shown || _drawn.count(frame) > 0; }
    // It is reached, and has no scene yet.
    bool isJoining() const { return _connections > 0 && (!_inSession || _firstFrame); }

 private:
    struct Drawing {
        std::uint64_t session = 0;
        std::uint64_t frame = 0;
        bool wantPixels = false;
        TimePoint done;
    };

    void turn(TimePoint now);
    void begin(TimePoint now);
    void finish();
    void follow();
    bool haveBlobs(const protocol::server_event::FrameRequested& frame);

    std::size_t _index;
    Observer& _observer;
    Planted _planted;
    Random _random;
    Duration _leastDraw;
    Duration _mostDraw;
    protocol::ServerNode _node;
    IdSource _ids;
    Aspect _scene;
    StateDigest _digest;
    wire::BlobStore _blobs;
    std::vector<TileAssignment> _tiles;
    std::deque<protocol::server_event::FrameRequested> _frames;
    std::vector<wire::Bytes> _stale;  // Planted::StaleSession
    bool _asked = false;
    std::uint64_t _session = 0;
    bool _inSession = false;
    bool _firstFrame = true;
    std::uint64_t _lastFrame = 0;
    std::optional<Drawing> _drawing;
    std::map<std::uint64_t, std::uint64_t> _drawn;  // frames of this session that are finished, and their digests
    std::uint64_t _shown = 0;
    bool _slow = false;
    int _connections = 0;
};

}  // namespace umbriel::sim
