#include "common/protocol/server_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/host_port.h"
#include "common/protocol/handshake.h"
#include "common/wire/view_codec.h"

namespace umbriel::protocol {

using wire::MessageType;
using namespace server_event;

namespace {

enum DialTag : std::uint64_t { kDialControl = 1, kDialBulk = 2 };

}  // namespace

ServerNode::ServerNode(ServerNodeOptions options, TimePoint now)
    : _options(std::move(options)), _redialAt(_options.dialHost.empty() ? TimePoint::max() : now) {
    _options.identity.role = wire::Role::Server;
    _options.identity.channel = wire::Channel::Control;
}

void ServerNode::opened(ConnectionId connection, std::uint64_t dialTag, TimePoint now) {
    if (dialTag == kDialControl) {
        _dialling = false;
        _dialledControl = connection;
    }
    if (_leaving || !admits(_options.maxConnections)) return decline(connection);
    wire::Hello hello = _options.identity;
    if (dialTag == kDialBulk) {
        if (!_session) return decline(connection);
        hello.channel = wire::Channel::Bulk;
        hello.token = _session->token;
        hello.epoch = _session->epoch;
    }
    adopt(connection, _options.link, std::move(hello), dialTag, now);
}

void ServerNode::dialFailed(std::uint64_t dialTag, const Error& reason, TimePoint now) {
    if (dialTag == kDialBulk)
        return endSession(fmt::format("the bulk connection cannot be opened: {}", reason.message));
    _dialling = false;
    unreachable({reason.kind, fmt::format("the client at {} cannot be reached: {}",
                                          hostPortText(_options.dialHost, _options.dialPort), reason.message)},
                now);
}

void ServerNode::unreachable(Error reason, TimePoint now) {
    if (reason.kind != Error::Kind::BadInput) _redialAt = now + _options.redialAfter;
    if (std::exchange(_lastUnreachable, reason.message) != reason.message)
        _events.push_back(ClientUnreachable{std::move(reason)});
}

void ServerNode::written(ConnectionId connection, TimePoint) {
    if (_session && _session->bulk == connection) fillBulk();
}

void ServerNode::advance(TimePoint now) {
    advanceLinks(now);
    if (!_dialling && now >= _redialAt) {
        _dialling = true;
        _redialAt = TimePoint::max();
        dial(kDialControl, _options.dialHost, _options.dialPort);
    }
}

TimePoint ServerNode::deadline() const {
    return std::min(_redialAt, linkDeadline());
}

std::optional<ServerEvent> ServerNode::nextEvent() {
    if (_events.empty()) return std::nullopt;
    ServerEvent event = std::move(_events.front());
    _events.pop_front();
    return event;
}

void ServerNode::linkOpen(ConnectionId connection, Peer& peer, TimePoint) {
    if (!_session || (_session->control != connection && _session->bulk != connection))
        return peer.link.close("there is no such session any more");
    if (_session->bulk == connection) return fillBulk();
    _session->started = true;
    _lastUnreachable.clear();
    _events.push_back(SessionStarted{_session->client});
    if (peer.tag != 0) dial(kDialBulk, _options.dialHost, _options.dialPort);
}

void ServerNode::message(ConnectionId, Peer& peer, MessageType type, std::span<const std::byte> payload, TimePoint) {
    if (const auto done = obey(type, payload); !done) peer.link.close(done.error().message);
}

void ServerNode::more(ConnectionId, Peer& peer, std::span<const std::byte> bytes, TimePoint) {
    if (!_session) return peer.link.close("the session has ended");
    if (const auto done = blobReceived(_session->receiver.more(bytes)); !done) peer.link.close(done.error().message);
}

std::size_t ServerNode::roomForMore(ConnectionId connection, const Peer&, std::span<std::span<std::byte>> places) {
    return _session && _session->bulk == connection ? _session->receiver.room(places) : 0;
}

void ServerNode::morePlaced(ConnectionId, Peer& peer, std::size_t count, TimePoint) {
    if (const auto done = blobReceived(_session->receiver.filled(count)); !done) peer.link.close(done.error().message);
}

Result<void> ServerNode::blobReceived(Result<std::optional<wire::Blob>> blob) {
    if (!blob) return blob.error();
    if (*blob) _events.push_back(BlobArrived{std::move(**blob)});
    return {};
}

void ServerNode::linkClosed(ConnectionId connection, Peer&, const std::string& reason, TimePoint now) {
    const bool ours = _session && (_session->control == connection || _session->bulk == connection);
    if (connection == _dialledControl && !_leaving) {
        if (ours && _session->started)
            _redialAt = now + _options.redialAfter;
        else
            unreachable(failure(reason), now);
    }
    if (ours) ended(reason);
}

bool ServerNode::clientIsSilent(TimePoint now) const {
    const Peer* found = peer(_session->control);
    return found && now - found->link.lastReceived() >= _options.clientSilence;
}

std::string ServerNode::objection(const wire::Hello& hello, bool bulk, bool dialled, TimePoint now) const {
    if (const std::string reason = handshakeObjection(_options.identity, hello); !reason.empty()) return reason;
    if (hello.role != wire::Role::Client) return "a render server serves clients, not other servers";
    if (hello.epoch == 0) return "a session epoch is at least 1";
    if (bulk) {
        if (!_session || !(_session->token == hello.token) || (!dialled && _session->epoch != hello.epoch))
            return "there is no session that this bulk connection belongs to";
        if (_session->bulk != 0) return "this session has a bulk connection already";
        return {};
    }
    if (!_session) return {};
    if (!(_session->token == hello.token))
        return clientIsSilent(now)
                   ? std::string()
                   : fmt::format("server '{}' is busy with client '{}'", _options.identity.name, _session->client);
    if (hello.epoch <= _session->epoch)
        return fmt::format("session epoch {} is not newer than {}", hello.epoch, _session->epoch);
    return {};
}

void ServerNode::greeted(ConnectionId connection, Peer& peer, TimePoint now) {
    const wire::Hello& hello = *peer.link.peerHello();
    if (const std::string reason = objection(hello, peer.link.isBulk(), peer.tag != 0, now); !reason.empty())
        return peer.link.refuse(reason);
    if (peer.link.isBulk()) {
        _session->bulk = connection;
        return peer.link.accept(_session->epoch);
    }
    if (_session)
        endSession(_session->token == hello.token
                       ? std::string("a newer session of the same client took over")
                       : fmt::format("the client was silent, and '{}' has come", hello.name));
    _session = Session();  // clang 14 takes the nested class for not default-constructible in emplace()
    _session->token = hello.token;
    _session->epoch = hello.epoch;
    _session->client = hello.name;
    _session->control = connection;
    peer.link.accept(hello.epoch);
}

Result<void> ServerNode::obey(MessageType type, std::span<const std::byte> payload) {
    if (!_session) return failure("the session has ended");
    switch (type) {
        case MessageType::Assign: {
            auto assign = wire::decode<wire::Assign>(payload);
            if (!assign) return assign.error();
            _session->assigned = true;
            _events.push_back(Assigned{assign->wall, std::move(assign->tiles)});
            return {};
        }
        case MessageType::Changes:
            return addChanges(payload);
        case MessageType::Frame:
            return frame(payload);
        case MessageType::Swap: {
            const auto swap = wire::decode<wire::Swap>(payload);
            if (!swap) return swap.error();
            const auto drawn = std::find(_session->shown.begin(), _session->shown.end(), swap->frame);
            if (drawn == _session->shown.end())
                return failure(fmt::format("a swap of frame {}, which is not ready", swap->frame));
            // Older ones were late, the wall went on without them: they are never shown.
            _session->shown.erase(_session->shown.begin(), drawn + 1);
            _events.push_back(SwapRequested{swap->frame});
            return {};
        }
        case MessageType::BlobWanted: {
            const auto wanted = wire::decode<wire::BlobWanted>(payload);
            if (!wanted) return wanted.error();
            for (const Hash128& hash : wanted->hashes) {
                const auto found = _session->results.find(hash);
                if (found == _session->results.end())
                    return failure(fmt::format("blob {} is no result of this session", toHex(hash)));
                _session->sender.addBlob(hash, std::move(found->second.content));
                _session->results.erase(found);
            }
            fillBulk();
            return {};
        }
        case MessageType::BlobData: {
            const auto data = wire::decode<wire::BlobData>(payload);
            if (!data) return data.error();
            return blobReceived(_session->receiver.part(*data));
        }
        case MessageType::DigestQuery: {
            const auto query = wire::decode<wire::DigestQuery>(payload);
            if (!query) return query.error();
            _events.push_back(DigestAsked{*query});
            return {};
        }
        case MessageType::Explain: {
            const auto explain = wire::decode<wire::Explain>(payload);
            if (!explain) return explain.error();
            _events.push_back(ExplainAsked{});
            return {};
        }
        case MessageType::JobOffer: {
            auto offer = wire::decode<wire::JobOffer>(payload);
            if (!offer) return offer.error();
            _events.push_back(JobOffered{offer->job, offer->attempt,
                                         std::chrono::milliseconds(offer->leaseMilliseconds), offer->kind,
                                         wire::Bytes(offer->payload.begin(), offer->payload.end()),
                                         std::move(offer->blobs)});
            return {};
        }
        case MessageType::JobCancel: {
            const auto cancel = wire::decode<wire::JobCancel>(payload);
            if (!cancel) return cancel.error();
            std::erase_if(_session->results, [&](const auto& entry) {
                return entry.second.job == cancel->job && entry.second.attempt == cancel->attempt;
            });
            _events.push_back(JobCancelled{cancel->job, cancel->attempt});
            return {};
        }
        case MessageType::Heartbeat:
            return {};  // the client's clock and screen are nothing to us
        default:
            return failure(fmt::format("a {} message is not for a server", wire::ruleOf(type).name));
    }
}

Result<void> ServerNode::frame(std::span<const std::byte> payload) {
    const auto frame = wire::decode<wire::Frame>(payload);
    if (!frame) return frame.error();
    if (!_session->assigned) return failure("a frame before tiles were assigned");
    if (frame->number <= _session->lastFrame)
        return failure(fmt::format("frame {} after frame {}", frame->number, _session->lastFrame));
    if (_session->drawing.size() >= kMaxFramesUnderWay) return failure("more frames than this server takes at once");
    FrameRequested request;
    if (!frame->views.empty()) {
        auto views = wire::decodeViews(frame->views);
        if (!views) return views.error();
        request.views = std::move(*views);
        _session->hasViews = true;
    }
    if (frame->time) _session->time = frame->time;
    if (!_session->hasViews || !_session->time) return failure("a session's first frame needs views and a time");
    if (!frame->changes.empty())
        if (const auto added = addChanges(frame->changes); !added) return added.error();
    request.number = frame->number;
    request.wantPixels = frame->wantPixels;
    request.wantCost = frame->wantCost;
    request.fromNothing = frame->fromNothing;
    request.time = *_session->time;
    request.changes = std::exchange(_session->changes, {});
    _session->changeBytes = 0;
    _session->lastFrame = frame->number;
    _session->drawing.push_back(frame->number);
    _events.push_back(std::move(request));
    return {};
}

Result<void> ServerNode::addChanges(std::span<const std::byte> part) {
    // An empty part costs memory, too.
    _session->changeBytes += part.size() + sizeof(wire::Bytes);
    if (_session->changeBytes > _options.identity.maxChangeBytes) return failure("a change list is too long");
    _session->changes.emplace_back(part.begin(), part.end());
    return {};
}

Link* ServerNode::control() {
    return _session && _session->started ? link(_session->control) : nullptr;
}

template <class Message>
void ServerNode::send(const Message& message) {
    Link* link = control();
    if (link && link->isOpen() && !link->send(message)) overflow();
}

void ServerNode::overflow() {
    endSession("the client reads too slowly");
}

void ServerNode::sendReady(std::uint64_t frame, wire::Ready ready) {
    if (!_session || _session->drawing.empty() || _session->drawing.front() != frame) return;  // of a session gone by
    _session->drawing.pop_front();
    _session->shown.push_back(frame);
    if (_session->shown.size() > kMaxFramesUnderWay) _session->shown.pop_front();
    ready.frame = static_cast<std::uint16_t>(frame);
    send(ready);
}

void ServerNode::reportSwap(std::uint64_t frame, TimePoint at) {
    if (Link* link = control()) link->reportSwap(frame, at);
}

void ServerNode::sendFailed(std::uint64_t frame, const std::string& text) {
    send(wire::Failed{frame, text});
}

void ServerNode::wantBlobs(const std::vector<wire::BlobRef>& blobs) {
    if (!_session) return;
    wire::BlobWanted wanted;
    for (const wire::BlobRef& blob : blobs) {
        if (_session->receiver.expect(blob)) wanted.hashes.push_back(blob.hash);
        if (wanted.hashes.size() == wire::BlobWanted::kMaxHashes) {
            send(wanted);
            wanted.hashes.clear();
        }
    }
    if (!wanted.hashes.empty()) send(wanted);
}

void ServerNode::sendTiles(std::uint64_t frame, std::vector<TilePixels> tiles) {
    if (!_session) return;
    for (TilePixels& tile : tiles) _session->sender.addTile(frame, std::move(tile));
    fillBulk();
}

void ServerNode::sendDigests(const wire::DigestReply& reply) {
    send(reply);
}

void ServerNode::sendExplanation(const std::string& text) {
    send(wire::ExplainReply{text});
}

void ServerNode::sendJobLease(const wire::JobLease& lease) {
    send(lease);
}

void ServerNode::sendJobDone(wire::JobDone done, wire::Bytes result) {
    if (!_session) return;
    done.resultBytes = result.size();
    if (!result.empty()) {
        MultiStorage content(1);
        content.resize(result.size());
        content.write(0, result);
        done.result = wire::hashOfBlob(content);
        _session->results.insert_or_assign(done.result,
                                           Session::JobResult{done.job, done.attempt, std::move(content)});
    }
    send(done);
}

void ServerNode::fillBulk() {
    if (!_session || _session->bulk == 0) return;
    if (Link* bulk = link(_session->bulk)) _session->sender.fill(*bulk);
}

void ServerNode::endSession(const std::string& reason) {
    ended(reason);
}

void ServerNode::leave(const std::string& reason) {
    endSession(reason);
    _leaving = true;
    _redialAt = TimePoint::max();
    dropAll(reason);
}

// Forgets the session and closes what is left of it.
void ServerNode::ended(const std::string& reason) {
    if (!_session) return;
    const Session session = std::move(*_session);
    _session.reset();
    if (session.started) _events.push_back(SessionEnded{reason});
    for (const ConnectionId id : {session.control, session.bulk}) {
        Link* left = link(id);
        if (!left || left->isClosed()) continue;
        left->close(reason);
        drop(id);
    }
}

}  // namespace umbriel::protocol
