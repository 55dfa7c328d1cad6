#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/protocol/cluster_client.h"

// The half of the client that runs frames; connections are in cluster_client.cpp.
namespace umbriel::protocol {

using wire::MessageType;

namespace {

// Change parts are queued up to here, so that a heartbeat or a swap never waits behind a whole snapshot.
constexpr std::size_t kControlTarget = std::size_t{1} << 20;
// Finished frames kept for a caller that does not ask.
constexpr std::size_t kMaxFinished = 4;
// So many digests in a row that differ: a snapshot does not help this server.
constexpr int kMaxMismatches = 2;

// A frame that no server draws takes this long.
constexpr Duration kNobodyPause = std::chrono::milliseconds(100);

std::shared_ptr<const wire::Bytes> shared(wire::Bytes bytes) {
    return std::make_shared<const wire::Bytes>(std::move(bytes));
}

}  // namespace

void ClusterClient::beginFrame(OutgoingFrame frame, TimePoint now) {
    UMBRIEL_ASSERT(_phase == Phase::Idle && _running.size() <= static_cast<std::size_t>(_options.latency),
                   "one request at a time");
    if (_error) return;
    _finishing = false;
    Running& running = _running.emplace_back();
    running.start = now;
    running.parts.resize(_servers.size());
    auto changes = packChanges(frame.number, std::exchange(frame.changes, {}), std::exchange(frame.blobs, {}));
    if (frame.fromNothing) {
        running.snapshot = std::move(changes);
        _history.restart(frame.number);
    } else {
        running.delta = changes;
        _history.add(std::move(changes));
        if (frame.snapshot)
            running.snapshot =
                packChanges(frame.number, std::move(frame.snapshot->parts), std::move(frame.snapshot->blobs));
    }
    running.frame = std::move(frame);
    const auto canDraw = [&](const Server& server) {
        const Session& session = server.session;
        if (session.comparing && (session.comparing->frame != 0 || !running.frame.digests)) return false;
        const std::size_t room = session.waitedFor ? static_cast<std::size_t>(_options.latency) : 0;
        return session.connected() && session.sent.size() <= room;
    };
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        const auto& comparing = _servers[i].session.comparing;
        if (comparing && (running.frame.fromNothing || now - comparing->since > _options.compareWithin))
            compared(i, std::nullopt, "what differs is not known: it does not answer in time");
    }
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        Part& part = running.parts[i];
        if (canDraw(_servers[i])) sendFrame(i, running, now);
        part.waitedFor = part.sent && _servers[i].session.waitedFor;
    }
    // A wall of which every server is new waits for all of them.
    if (std::none_of(running.parts.begin(), running.parts.end(), [](const Part& part) { return part.waitedFor; }))
        for (Part& part : running.parts) part.waitedFor = part.sent;

    std::uint64_t needed = running.frame.number;
    for (const Server& server : _servers)
        if (server.session.connected() && !server.session.needsSnapshot) needed = std::min(needed, server.session.upTo);
    _history.forget(needed);
    progress(now);
}

void ClusterClient::sendFrame(std::size_t index, Running& running, TimePoint now) {
    Server& server = _servers[index];
    Session& session = server.session;
    const OutgoingFrame& frame = running.frame;
    FrameHistory::Frames changes;
    const bool known = !frame.fromNothing && !session.needsSnapshot;
    if (known) {
        auto since = _history.since(session.upTo);
        if (since)
            changes = std::move(*since);
        else
            session.needsSnapshot = true;
    }
    const bool fromNothing = frame.fromNothing || session.needsSnapshot;
    if (fromNothing) {
        if (session.comparing) compared(index, std::nullopt, "what differs is not known: it is too far behind");
        if (!running.snapshot) return;  // wantsSnapshot() says so
        changes = {running.snapshot};
        session.needsSnapshot = false;
    }
    if (const std::string reason = beyondLimits(index, changes); !reason.empty()) return lose(index, reason, now);
    for (std::size_t i = 0; i < changes.size(); ++i) {
        for (const auto& part : changes[i]->parts) session.outbox.emplace_back(MessageType::Changes, part);
        if (i + 1 < changes.size() && !changes[i]->last.empty())
            session.outbox.emplace_back(MessageType::Changes, shared(wire::encode(wire::Changes{changes[i]->last})));
    }
    if (session.comparing) {
        session.comparing->frame = frame.number;
        session.comparing->digests.emplace(frame.digests);
    }
    Part& part = running.parts[index];
    const bool withViews = session.views != frame.views;
    const bool withTime = !session.time || *session.time != frame.time;
    session.outbox.emplace_back(MessageType::Frame, frameMessage(running, fromNothing, withViews, withTime));
    session.views = frame.views;
    session.time = frame.time;
    session.upTo = frame.number;
    session.sent.push_back({frame.number, frame.digest, now, std::move(changes)});
    part.sent = true;
    part.outcome.viewBytes = withViews ? frame.views.size() : 0;
    if (frame.wantPixels && !server.remote.tiles.empty()) {
        part.tilesDone = false;
        part.tiles.expect(frame.number, server.remote.tiles);
        session.pixelsUpTo = frame.number;
    }
    feed(server);
}

std::string ClusterClient::beyondLimits(std::size_t index, const FrameHistory::Frames& changes) const {
    const wire::Hello* hello = serverHello(index);
    std::uint64_t bytes = 0, longest = 0;
    for (const auto& one : changes) {
        bytes += one->changeBytes;
        longest = std::max(longest, one->longestBlob);
    }
    if (!hello || (bytes <= hello->maxChangeBytes && longest <= hello->maxBlobBytes)) return {};
    return bytes > hello->maxChangeBytes ? fmt::format("{} takes {} bytes of changes at once, the scene needs {}",
                                                       textOf(index), hello->maxChangeBytes, bytes)
                                         : fmt::format("{} takes blobs of {} bytes, the scene has one of {}",
                                                       textOf(index), hello->maxBlobBytes, longest);
}

std::shared_ptr<const wire::Bytes> ClusterClient::frameMessage(Running& running, bool fromNothing, bool withViews,
                                                               bool withTime) {
    for (const EncodedFrame& one : running.encoded)
        if (one.fromNothing == fromNothing && one.withViews == withViews && one.withTime == withTime)
            return one.payload;
    wire::Frame message;
    message.number = running.frame.number;
    message.wantPixels = running.frame.wantPixels;
    message.wantCost = running.frame.wantCost;
    message.fromNothing = fromNothing;
    if (withTime) message.time = running.frame.time;
    if (withViews) message.views = running.frame.views;
    message.changes = (fromNothing ? running.snapshot : running.delta)->last;
    running.encoded.push_back({fromNothing, withViews, withTime, shared(wire::encode(message))});
    return running.encoded.back().payload;
}

void ClusterClient::feed(Server& server) {
    Session& session = server.session;
    Link* control = link(session.control);
    while (control && control->isOpen() && !session.outbox.empty() && control->output().size() < kControlTarget) {
        const auto& [type, payload] = session.outbox.front();
        if (!control->sendShared(type, payload)) return;  // the queue has no room; its server is late or lost soon
        session.outbox.pop_front();
    }
}

Result<void> ClusterClient::answer(std::size_t index, MessageType type, std::span<const std::byte> payload,
                                   TimePoint now) {
    Server& server = _servers[index];
    switch (type) {
        case MessageType::Ready: {
            const auto message = wire::decode<wire::Ready>(payload);
            if (!message) return message.error();
            return ready(index, *message, now);
        }
        case MessageType::Heartbeat: {
            const auto message = wire::decode<wire::Heartbeat>(payload);
            if (!message) return message.error();
            heartbeat(index, *message, now);
            return {};
        }
        case MessageType::Failed: {
            const auto failed = wire::decode<wire::Failed>(payload);
            if (!failed) return failed.error();
            return failure(fmt::format("frame {} cannot be drawn: {}", failed->frame, failed->text));
        }
        case MessageType::BlobWanted: {
            const auto wanted = wire::decode<wire::BlobWanted>(payload);
            if (!wanted) return wanted.error();
            for (const Hash128& hash : wanted->hashes) {
                const MultiStorage* content = nullptr;
                for (const Sent& sent : server.session.sent)
                    for (const auto& changes : sent.changes)
                        if (const auto found = changes->blobs.find(hash); found != changes->blobs.end())
                            content = &found->second;
                if (const auto found = _jobBlobs.find(hash); found != _jobBlobs.end()) content = &found->second;
                if (!content)
                    return failure(fmt::format("it asks for blob {}, which is not in this frame", toHex(hash)));
                server.session.sender.addBlob(hash, *content);
            }
            if (Link* bulk = link(server.session.bulk)) server.session.sender.fill(*bulk);
            return {};
        }
        case MessageType::TileData: {
            const auto data = wire::decode<wire::TileData>(payload);
            if (!data) return data.error();
            return tileData(index, *data);
        }
        case MessageType::DigestReply: {
            auto reply = wire::decode<wire::DigestReply>(payload);
            if (!reply) return reply.error();
            auto& comparing = server.session.comparing;
            if (comparing && comparing->digests && server.session.sent.empty()) {
                comparing->digests->answered(*reply);
                if (const auto difference = comparing->digests->difference())
                    compared(index, difference, "what differs is known");
                else if (Link* control = link(server.session.control))
                    control->send(comparing->digests->query());
                return {};
            }
            // An answer that came too late.
            if (_phase == Phase::Idle && _options.policy != FailurePolicy::Wait && server.session.mismatches > 0)
                return {};
            if (_phase != Phase::Digests || index != _digestServer)
                return failure("it sends digests that nobody asked for");
            _digests = std::move(*reply);
            _phase = Phase::Idle;
            return {};
        }
        case MessageType::ExplainReply: {
            auto reply = wire::decode<wire::ExplainReply>(payload);
            if (!reply) return reply.error();
            if (_phase != Phase::Explaining || server.explanation) return failure("it explains what nobody asked for");
            server.explanation = std::move(reply->text);
            return {};
        }
        case MessageType::BlobData:
        case MessageType::JobLease:
        case MessageType::JobDone:
            return jobMessage(index, type, payload);
        default:
            return failure(fmt::format("a {} message has no meaning here", wire::ruleOf(type).name));
    }
}

Result<void> ClusterClient::ready(std::size_t index, const wire::Ready& message, TimePoint now) {
    Server& server = _servers[index];
    Session& session = server.session;
    if (session.sent.empty() || message.frame != static_cast<std::uint16_t>(session.sent.front().number))
        return failure(fmt::format("it is ready with frame {}, which was not asked for", message.frame));
    const Sent sent = std::move(session.sent.front());
    session.sent.pop_front();
    const bool right = message.digest == sent.digest;
    const auto running = std::find_if(_running.begin(), _running.end(),
                                      [&](const Running& one) { return one.frame.number == sent.number; });
    if (running != _running.end()) {
        Part& part = running->parts[index];
        part.ready = true;
        part.readyAt = now;
        part.differs = !right;
        part.outcome.ready = message;
    }
    if (_options.policy == FailurePolicy::Wait) return {};
    if (!right) {
        // What it draws is not the scene: it shows nothing of it, and starts again from a snapshot.
        return differs(index, sent, now);
    }
    if (session.comparing && session.comparing->frame == sent.number)
        compared(index, DigestDifference{}, "the frames after it made it equal again");
    if (!session.needsSnapshot) session.mismatches = 0;
    if (now - sent.at <= *_pacing.allowance() && !session.needsSnapshot && !session.owesPixels)
        session.waitedFor = true;
    // The others show this frame and wait for no newer one: the tile is late but right.
    if (sent.number == _lastSwapped && !session.needsSnapshot) {
        swap(index, sent.number);
        if (running != _running.end()) running->parts[index].outcome.shown = true;
    }
    return {};
}

Result<void> ClusterClient::differs(std::size_t index, const Sent& sent, TimePoint now) {
    Server& server = _servers[index];
    Session& session = server.session;
    if (session.comparing) {
        // Of the frame with latency 1 that followed; or all is there for the questions.
        if (session.comparing->frame != sent.number) return {};
        if (Link* control = link(session.control)) control->send(session.comparing->digests->query());
        return {};
    }
    if (++session.mismatches >= kMaxMismatches)
        return failure(
            fmt::format("its state differs from the client's in frame {}, although it had a snapshot", sent.number));
    session.waitedFor = false;
    server.whole = false;
    if (_options.compareWithin.count() > 0)
        session.comparing = Comparing{now, 0, {}};
    else
        session.needsSnapshot = true;
    report(ServerIncident::Kind::Differing, index,
           fmt::format("the state of {} differs in frame {}: it gets a snapshot", textOf(index), sent.number));
    return {};
}

void ClusterClient::compared(std::size_t index, std::optional<DigestDifference> difference, std::string_view text) {
    Session& session = _servers[index].session;
    session.comparing.reset();
    session.needsSnapshot = true;
    report(ServerIncident::Kind::Compared, index, fmt::format("the state of {}: {}", textOf(index), text), difference);
}

Result<void> ClusterClient::tileData(std::size_t index, const wire::TileData& data) {
    for (Running& running : _running) {
        Part& part = running.parts[index];
        if (running.frame.number != data.frame || part.tilesDone) continue;
        const auto done = part.tiles.part(data);
        if (!done) return done.error();
        if (*done) {
            _servers[index].session.owesPixels = false;
            part.tilesDone = true;
            part.outcome.tiles = part.tiles.take();
        }
        return {};
    }
    // Of a frame that went on without them.
    Session& session = _servers[index].session;
    if (_options.policy != FailurePolicy::Wait && data.frame <= session.pixelsUpTo) {
        const bool ends = data.layerIndex + 1 == data.layerCount && data.offset + data.bytes.size() == data.total;
        if (data.frame == session.pixelsUpTo && ends) session.owesPixels = false;
        return {};
    }
    return failure("it sends pixels that nobody asked for");
}

void ClusterClient::progress(TimePoint now) {
    if (_phase == Phase::Explaining &&
        std::all_of(_servers.begin(), _servers.end(), [](const Server& one) { return one.explanation.has_value(); }))
        _phase = Phase::Idle;
    while (!_error && !_running.empty()) {
        Running& running = _running.front();
        if (!running.swapped && !swapWhenReady(running, now)) return;
        if (running.swapped && !tilesOver(running, now)) return;
        finishFrame(running, now);
    }
}

// Everything is new in a frame from nothing: shaders are compiled, scenes uploaded, at very different speeds.
std::optional<Duration> ClusterClient::allowanceOf(const Running& running) const {
    if (_options.policy == FailurePolicy::Degrade && running.frame.fromNothing) return FramePacing::kStrictLimit;
    return _pacing.allowance();
}

bool ClusterClient::isDue(Running& running, std::size_t done, std::size_t of, TimePoint now) {
    if (_options.policy == FailurePolicy::Wait) return false;
    if (of == 0) {
        // Nobody to wait for. The pause keeps the caller from running in circles; a server that needs a snapshot needs
        // the next frame.
        running.due = std::min(running.due.value_or(TimePoint::max()), running.start + kNobodyPause);
        return now >= *running.due || wantsSnapshot() || wantsDigests();
    }
    if (!running.due && done > 0 && 2 * done >= of) running.due = now + *allowanceOf(running);
    return running.due && now >= *running.due;
}

std::optional<TimePoint> ClusterClient::dueAt() const {
    return _running.empty() ? std::nullopt : _running.front().due;
}

// True when the frame was swapped, or is over without.
bool ClusterClient::swapWhenReady(Running& running, TimePoint now) {
    std::size_t of = 0, done = 0;
    for (const Part& part : running.parts) {
        if (!part.waitedFor) continue;
        ++of;
        done += part.ready;
    }
    const bool due = isDue(running, done, of, now);
    const bool all = done == of && (of > 0 || _servers.empty());
    if (!all && !due) return false;
    const std::uint64_t number = running.frame.number;
    for (std::size_t i = 0; i < running.parts.size(); ++i)
        if (running.parts[i].ready && running.parts[i].outcome.ready.digest != running.frame.digest &&
            !running.mismatch)
            running.mismatch = i;
    if (running.mismatch && _options.policy == FailurePolicy::Wait)
        return true;  // nothing is shown: the caller asks what differs
    std::vector<std::size_t> told;
    for (std::size_t i = 0; i < running.parts.size(); ++i) {
        Part& part = running.parts[i];
        if (part.waitedFor && !part.ready) becameLate(i, number);
        if (!part.ready || part.differs) {
            part.waitedFor = false;
            part.tilesDone = true;
            continue;
        }
        swap(i, number);
        told.push_back(i);
        part.outcome.shown = true;
        part.outcome.wait = now - part.readyAt;
    }
    if (_error) return true;
    _skew.told(number, std::move(told));
    running.swapped = true;
    running.due.reset();
    _lastSwapped = number;
    if (done > 0) _pacing.took(now - running.start);
    return true;
}

void ClusterClient::becameLate(std::size_t index, std::uint64_t frame) {
    Server& server = _servers[index];
    server.session.waitedFor = false;
    for (Running& later : _running) later.parts[index].waitedFor = false;
    if (!std::exchange(server.whole, false)) return;
    report(ServerIncident::Kind::Late, index,
           fmt::format("{} is late with frame {}: the wall goes on, its tiles hold their "
                       "last picture",
                       textOf(index), frame));
}

void ClusterClient::swap(std::size_t index, std::uint64_t frame) {
    Server& server = _servers[index];
    Link* control = link(server.session.control);
    if (!control || !control->send(wire::Swap{frame})) return;  // it is lost, or about to be: it reads nothing
    server.failures = 0;
    if (server.session.owesPixels || std::exchange(server.whole, true)) return;
    server.lost = false;
    server.lastFailure.clear();
    report(ServerIncident::Kind::Rejoined, index, fmt::format("{} is back in step at frame {}", textOf(index), frame));
}

// True when all pixels that were asked for are there, or are late.
bool ClusterClient::tilesOver(Running& running, TimePoint now) {
    std::size_t of = 0, done = 0;
    for (const Part& part : running.parts) {
        if (!part.outcome.shown || !part.sent) continue;
        ++of;
        done += part.tilesDone;
    }
    if (done == of) return true;
    if (!isDue(running, done, of, now)) return false;
    for (std::size_t i = 0; i < running.parts.size(); ++i) {
        Part& part = running.parts[i];
        if (part.tilesDone) continue;
        part.tilesDone = true;
        _servers[i].session.owesPixels = true;
        becameLate(i, running.frame.number);
    }
    return true;
}

void ClusterClient::finishFrame(Running& running, TimePoint now) {
    Finished& finished = _finished.emplace_back();
    finished.number = running.frame.number;
    finished.mismatch = running.mismatch;
    finished.took = now - running.start;
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        Server& server = _servers[i];
        ServerOutcome& outcome = finished.servers.emplace_back(std::move(running.parts[i].outcome));
        outcome.connected = server.session.connected();
        const std::uint64_t sent = bytesSent(server);
        outcome.bytes = sent - std::min(sent, server.session.bytesBefore);
        server.session.bytesBefore = sent;
    }
    if (_finished.size() > kMaxFinished) _finished.pop_front();
    _running.pop_front();
}

std::vector<ClusterClient::Finished> ClusterClient::takeFinished() {
    std::vector<Finished> finished(std::make_move_iterator(_finished.begin()),
                                   std::make_move_iterator(_finished.end()));
    _finished.clear();
    return finished;
}

std::vector<ServerOutcome> ClusterClient::takeOutcome() {
    if (_finished.empty()) return {};
    return std::exchange(_finished.back().servers, {});
}

std::optional<std::size_t> ClusterClient::mismatch() const {
    return _finished.empty() ? std::nullopt : _finished.back().mismatch;
}

}  // namespace umbriel::protocol
