#include "tests/sim/model_server.h"

#include <utility>

namespace umbriel::sim {

namespace event = protocol::server_event;
using protocol::ConnectionId;

namespace {

protocol::ServerNodeOptions nodeOptions(const std::string& name, const TypeRegistry& types) {
    protocol::ServerNodeOptions options;
    options.identity.name = name;
    options.identity.build = "sim";
    options.identity.typeSignature = types.signature();
    return options;
}

// A stalled driver, a hot processor: far beyond every deadline.
constexpr int kSlowFactor = 40;

}  // namespace

ModelServer::ModelServer(std::size_t index, const std::string& name, const TypeRegistry& types, Observer& observer,
                         Planted planted, std::uint64_t seed, Duration leastDraw, Duration mostDraw, TimePoint now)
    : _index(index),
      _observer(observer),
      _planted(planted),
      _random(seed),
      _leastDraw(leastDraw),
      _mostDraw(mostDraw),
      _node(nodeOptions(name, types), now),
      _scene(types, _ids) {}

void ModelServer::opened(ConnectionId connection, std::uint64_t tag, TimePoint now) {
    ++_connections;
    _node.opened(connection, tag, now);
    turn(now);
}

void ModelServer::dialFailed(std::uint64_t tag, const Error& reason, TimePoint now) {
    _node.dialFailed(tag, reason, now);
}

void ModelServer::received(ConnectionId connection, std::span<const std::byte> bytes, TimePoint now) {
    _node.received(connection, bytes, now);
    turn(now);
}

void ModelServer::written(ConnectionId connection, TimePoint now) {
    _node.written(connection, now);
}

void ModelServer::closed(ConnectionId connection, const std::string& reason, TimePoint now) {
    --_connections;
    _node.closed(connection, reason, now);
    turn(now);
}

void ModelServer::advance(TimePoint now) {
    _node.advance(now);
    if (_drawing && now >= _drawing->done) finish();
    turn(now);
}

TimePoint ModelServer::deadline() const {
    return _drawing ? std::min(_node.deadline(), _drawing->done) : _node.deadline();
}

void ModelServer::turn(TimePoint now) {
    while (auto next = _node.nextEvent()) {
        if (std::get_if<event::SessionStarted>(&*next)) {
            ++_session;
            _inSession = true;
            _firstFrame = true;
            _drawn.clear();
        } else if (auto* ended = std::get_if<event::SessionEnded>(&*next)) {
            if (ended->reason.find("took over") != std::string::npos) _observer.hit(Probe::Fenced);
            if (_planted == Planted::StaleSession && !_frames.empty()) _stale = _frames.back().changes;
            _inSession = false;
            _frames.clear();
            _asked = false;
        } else if (auto* assigned = std::get_if<event::Assigned>(&*next)) {
            _tiles = std::move(assigned->tiles);
        } else if (auto* frame = std::get_if<event::FrameRequested>(&*next)) {
            if (!_firstFrame && frame->fromNothing) _observer.hit(Probe::SnapshotInSession);
            if (!_firstFrame && !frame->fromNothing && frame->number > _lastFrame + 1) _observer.hit(Probe::CatchUp);
            _firstFrame = false;
            _lastFrame = frame->number;
            _frames.push_back(std::move(*frame));
        } else if (auto* swap = std::get_if<event::SwapRequested>(&*next)) {
            const auto drawn = _planted == Planted::ShowsWhatIsDrawn ? _drawn.begin() : _drawn.find(swap->frame);
            std::optional<std::uint64_t> digest;
            if (drawn != _drawn.end()) digest = drawn->second;
            _shown = swap->frame;
            _observer.shows(_index, swap->frame, digest);
            _drawn.erase(_drawn.begin(), _drawn.upper_bound(swap->frame));
        } else if (auto* arrived = std::get_if<event::BlobArrived>(&*next)) {
            _observer.hit(Probe::BlobFetched);
            _blobs.put(std::move(arrived->blob));
        }
    }
    if (!_drawing && !_frames.empty() && haveBlobs(_frames.front())) begin(now);
}

bool ModelServer::haveBlobs(const event::FrameRequested& frame) {
    std::vector<wire::BlobRef> missing;
    for (const wire::Bytes& part : frame.changes) {
        const auto refs = wire::blobsReferenced(part);
        if (!refs) {
            _node.endSession(refs.error().message);
            return false;
        }
        for (const wire::BlobRef& ref : *refs)
            if (!_blobs.find(ref.hash)) missing.push_back(ref);
    }
    if (!missing.empty() && !std::exchange(_asked, true)) _node.wantBlobs(missing);
    return missing.empty();
}

void ModelServer::follow() {
    const ChangeList changes = _scene.commit();
    _digest.update(changes, _scene);
}

void ModelServer::begin(TimePoint now) {
    event::FrameRequested frame = std::move(_frames.front());
    _frames.pop_front();
    _asked = false;
    if (frame.fromNothing && _planted != Planted::NotEmptied) {
        RawEdit edit(_scene);
        for (const ContainerId id : _scene.ids()) edit.destroy(id);
        follow();
    }
    for (const wire::Bytes& part : frame.changes)
        if (const auto done = wire::applyChanges(part, _scene, _blobs); !done)
            return _node.endSession(done.error().message);
    follow();
    if (frame.fromNothing && !_stale.empty()) {
        for (const wire::Bytes& part : std::exchange(_stale, {})) (void)wire::applyChanges(part, _scene, _blobs);
        follow();
    }
    Duration time(_random.between(_leastDraw.count(), _mostDraw.count()));
    if (_slow) time *= kSlowFactor;
    _drawing = Drawing{_session, frame.number, frame.wantPixels, now + time};
    if (_planted == Planted::ReadyEarly && _random.chance(5)) {
        wire::Ready ready;
        ready.digest = _digest.total();
        _node.sendReady(frame.number, ready);
    }
}

void ModelServer::finish() {
    const Drawing drawing = *std::exchange(_drawing, std::nullopt);
    // An answer for a session that has ended is nobody's.
    if (drawing.session != _session || !_inSession) return _observer.hit(Probe::StaleAnswer);
    _drawn[drawing.frame] = _digest.total();
    if (_planted == Planted::ShowsAtOnce && _random.chance(5)) _observer.shows(_index, drawing.frame, _digest.total());
    wire::Ready ready;
    ready.digest = _digest.total();
    _node.sendReady(drawing.frame, ready);
    if (!drawing.wantPixels) return;
    std::vector<TilePixels> pixels;
    for (const TileAssignment& tile : _tiles)
        pixels.push_back({tile,
                          {{Layer::Colour, "colour", 4, ComponentType::Float,
                            std::vector<std::byte>(static_cast<std::size_t>(tile.pixels.area()) * 16)}}});
    _node.sendTiles(drawing.frame, std::move(pixels));
}

}  // namespace umbriel::sim
