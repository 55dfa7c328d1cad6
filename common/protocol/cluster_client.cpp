#include "common/protocol/cluster_client.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/protocol/handshake.h"

namespace umbriel::protocol {

using wire::MessageType;

namespace {

// Dial tags: 1 + 2 * server, one more for its bulk connection.
std::uint64_t tagOf(std::size_t server, bool bulk) { return 1 + 2 * server + (bulk ? 1 : 0); }

// Change parts are queued up to here, so that a heartbeat or a swap never waits behind a whole snapshot.
constexpr std::size_t kControlTarget = std::size_t{1} << 20;

}  // namespace

ClusterClient::ClusterClient(ClusterClientOptions options, TimePoint now)
    : _options(std::move(options)), _phaseStart(now) {
    _options.identity.role = wire::Role::Client;
    _options.identity.token = _options.token;
    _options.identity.epoch = _options.epoch;
    // Reserved at once: pointers into it stay valid.
    _servers.reserve(_options.servers.size());
    for (const RemoteServer& remote : _options.servers) {
        _servers.emplace_back();
        _servers.back().remote = remote;
    }
    for (std::size_t i = 0; i < _servers.size(); ++i)
        if (!_servers[i].remote.host.empty()) dial(i, false);
    if (_servers.empty()) _phase = Phase::Idle;
}

void ClusterClient::dial(std::size_t server, bool bulk) {
    const RemoteServer& remote = _servers[server].remote;
    _actions.push_back({Action::Kind::Dial, 0, tagOf(server, bulk), remote.host, remote.port});
}

std::string ClusterClient::textOf(std::size_t index) const {
    const Server& server = _servers[index];
    std::string name = server.remote.name;
    if (server.controlOpen)
        if (const auto found = _peers.find(server.control); found != _peers.end() && found->second.link->peerHello())
            name = found->second.link->peerHello()->name;
    std::string text = name.empty() ? "server" : fmt::format("server '{}'", name);
    if (!server.remote.host.empty()) text += fmt::format(" at {}:{}", server.remote.host, server.remote.port);
    return text;
}

void ClusterClient::opened(ConnectionId connection, std::uint64_t dialTag, TimePoint now) {
    if (_error || _peers.size() > 4 * _servers.size() + 16) {
        _actions.push_back({Action::Kind::Close, connection, 0, {}, 0});
        return;
    }
    Peer peer;
    wire::Hello hello = _options.identity;
    if (dialTag != 0) {
        peer.server = static_cast<std::size_t>((dialTag - 1) / 2);
        peer.known = true;
        peer.bulk = (dialTag - 1) % 2 == 1;
        hello.channel = peer.bulk ? wire::Channel::Bulk : wire::Channel::Control;
        hello.wantedName = _servers[peer.server].remote.name;
        (peer.bulk ? _servers[peer.server].bulk : _servers[peer.server].control) = connection;
    }
    peer.link = std::make_unique<Link>(_options.link, std::move(hello), now);
    _peers.emplace(connection, std::move(peer));
}

void ClusterClient::dialFailed(std::uint64_t dialTag, const Error& reason, TimePoint now) {
    const auto index = static_cast<std::size_t>((dialTag - 1) / 2);
    Server& server = _servers[index];
    if (reason.kind == Error::Kind::BadInput) {
        const std::string message = fmt::format("{}: {}", textOf(server), reason.message);
        return fail(badInput(message));
    }
    server.lastFailure = reason.message;
    server.redialBulk = (dialTag - 1) % 2 == 1;
    server.redialAt = now + _options.redialAfter;
}

void ClusterClient::received(ConnectionId connection, std::span<const std::byte> bytes, TimePoint now) {
    const auto found = _peers.find(connection);
    if (found == _peers.end() || found->second.closing) return;
    found->second.link->received(bytes, now);
    drain(connection, now);
}

void ClusterClient::written(ConnectionId connection, TimePoint) {
    const auto found = _peers.find(connection);
    if (found == _peers.end() || !found->second.known) return;
    Server& server = _servers[found->second.server];
    if (connection == server.bulk) server.sender.fill(*found->second.link);
    else if (connection == server.control) feed(server);
}

void ClusterClient::closed(ConnectionId connection, const std::string& reason, TimePoint now) {
    const auto found = _peers.find(connection);
    if (found == _peers.end()) return;
    found->second.link->lost(reason);
    drain(connection, now);
    _peers.erase(connection);
}

void ClusterClient::advance(TimePoint now) {
    std::vector<ConnectionId> ids;
    for (auto& [id, peer] : _peers) {
        peer.link->advance(now);
        ids.push_back(id);
    }
    for (const ConnectionId id : ids) drain(id, now);
    if (_error) return;
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        Server& server = _servers[i];
        if (!server.redialAt || now < *server.redialAt) continue;
        server.redialAt.reset();
        dial(i, server.redialBulk);
    }
    if (_phase == Phase::Connecting && now >= _phaseStart + _options.connectTimeout) {
        for (std::size_t i = 0; i < _servers.size(); ++i) {
            const Server& server = _servers[i];
            if (server.controlOpen && server.bulkOpen) continue;
            if (server.remote.host.empty())
                return fail(fmt::format("{} has not dialled within {:.1f} s", textOf(i), toSeconds(_options.connectTimeout)));
            if (server.control != 0)
                return fail(fmt::format("{} does not complete the handshake within {:.1f} s", textOf(i),
                                        toSeconds(_options.connectTimeout)));
            return fail(fmt::format("{} cannot be reached: {}; is umbriel-server running there?", textOf(i),
                                    server.lastFailure.empty() ? "no answer" : server.lastFailure));
        }
    }
    if (_phase == Phase::Drawing && _options.frameTimeout.count() > 0 && now >= _phaseStart + _options.frameTimeout) {
        std::string names;
        for (const std::string& name : waitingFor()) names += (names.empty() ? "" : ", ") + name;
        fail(fmt::format("frame {} is not drawn within {:.1f} s: still waiting for {}", _frame.number,
                         toSeconds(_options.frameTimeout), names));
    }
}

TimePoint ClusterClient::deadline() const {
    TimePoint earliest = TimePoint::max();
    for (const auto& [id, peer] : _peers) earliest = std::min(earliest, peer.link->deadline());
    if (_error) return earliest;
    for (const Server& server : _servers)
        if (server.redialAt) earliest = std::min(earliest, *server.redialAt);
    if (_phase == Phase::Connecting) earliest = std::min(earliest, _phaseStart + _options.connectTimeout);
    if (_phase == Phase::Drawing && _options.frameTimeout.count() > 0)
        earliest = std::min(earliest, _phaseStart + _options.frameTimeout);
    return earliest;
}

std::optional<Action> ClusterClient::nextAction() {
    if (_actions.empty()) return std::nullopt;
    Action action = std::move(_actions.front());
    _actions.pop_front();
    return action;
}

Link* ClusterClient::link(ConnectionId connection) {
    const auto found = _peers.find(connection);
    return found == _peers.end() ? nullptr : found->second.link.get();
}

SendQueue* ClusterClient::output(ConnectionId connection) {
    Link* found = link(connection);
    return found ? &found->output() : nullptr;
}

void ClusterClient::drain(ConnectionId connection, TimePoint now) {
    for (auto found = _peers.find(connection); found != _peers.end(); found = _peers.find(connection)) {
        Peer& peer = found->second;
        const LinkEvent event = peer.link->next();
        switch (event.kind) {
            case LinkEvent::Kind::None:
                return;
            case LinkEvent::Kind::Hello:
                greeted(connection, peer);
                break;
            case LinkEvent::Kind::Open:
                linkOpen(connection, peer);
                break;
            case LinkEvent::Kind::Message: {
                Server& server = _servers[peer.server];
                if (const auto done = message(server, event.type, event.payload, now); !done)
                    fail(fmt::format("{}: {}", textOf(server), done.error().message));
                break;
            }
            case LinkEvent::Kind::Closed: {
                const bool ours = peer.known && (_servers[peer.server].control == connection ||
                                                 _servers[peer.server].bulk == connection);
                const std::string reason = peer.link->reason();
                drop(connection);
                if (!ours) break;
                const RemoteServer& remote = _servers[peer.server].remote;
                fail(remote.host.empty() ? reason : fmt::format("{} (at {}:{})", reason, remote.host, remote.port));
                break;
            }
        }
    }
}

void ClusterClient::greeted(ConnectionId connection, Peer& peer) {
    const wire::Hello& hello = *peer.link->peerHello();
    wire::Hello mine = _options.identity;
    if (!peer.known) {
        // It dialled us: a bulk connection shows our token, a control connection the name of a server we wait for.
        const bool bulk = hello.channel == wire::Channel::Bulk;
        const bool ours = !bulk || (hello.token == _options.token && hello.epoch == _options.epoch);
        const auto found = std::find_if(_servers.begin(), _servers.end(), [&](const Server& server) {
            return server.remote.host.empty() && (bulk ? server.controlOpen && server.bulk == 0 : server.control == 0) &&
                   (server.remote.name.empty() || server.remote.name == hello.name);
        });
        if (!ours || found == _servers.end())
            return peer.link->refuse(fmt::format("client '{}' does not wait for a server '{}'", mine.name, hello.name));
        peer.server = static_cast<std::size_t>(found - _servers.begin());
        peer.bulk = bulk;
    } else {
        mine.wantedName = _servers[peer.server].remote.name;
    }
    if (const std::string reason = handshakeObjection(mine, hello); !reason.empty()) return peer.link->refuse(reason);
    if (!peer.known) {
        peer.known = true;
        (peer.bulk ? _servers[peer.server].bulk : _servers[peer.server].control) = connection;
    }
    peer.link->accept(_options.epoch);
}

void ClusterClient::linkOpen(ConnectionId connection, Peer& peer) {
    Server& server = _servers[peer.server];
    if (peer.bulk) {
        server.bulkOpen = true;
        server.sender.fill(*peer.link);
    } else {
        server.controlOpen = true;
        UMBRIEL_ASSERT(server.control == connection, "an open control connection belongs to its server");
        peer.link->send(wire::Assign{_options.wall, server.remote.tiles});
        if (!server.remote.host.empty()) dial(peer.server, true);
    }
    const bool all = std::all_of(_servers.begin(), _servers.end(),
                                 [](const Server& one) { return one.controlOpen && one.bulkOpen; });
    if (_phase == Phase::Connecting && all) _phase = Phase::Idle;
}

std::uint64_t ClusterClient::bytesSent(const Server& server) const {
    std::uint64_t sum = 0;
    for (const ConnectionId id : {server.control, server.bulk})
        if (const auto found = _peers.find(id); found != _peers.end()) sum += found->second.link->bytesSent();
    return sum;
}

void ClusterClient::assign(PixelSize wall, std::vector<std::vector<TileAssignment>> tiles) {
    UMBRIEL_ASSERT(!isBusy() && tiles.size() == _servers.size(), "tiles change between requests, for every server");
    if (_error) return;
    _options.wall = wall;
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        Server& server = _servers[i];
        server.remote.tiles = std::move(tiles[i]);
        if (Link* control = link(server.control); control && !control->send(wire::Assign{wall, server.remote.tiles}))
            return fail(fmt::format("{} does not read what it is sent", textOf(server)));
    }
}

void ClusterClient::beginFrame(OutgoingFrame frame, TimePoint now) {
    UMBRIEL_ASSERT(_phase == Phase::Idle, "one request at a time");
    if (_error) return;
    _phase = Phase::Drawing;
    _phaseStart = now;
    _frame = std::move(frame);
    _swapped = false;
    _mismatch.reset();
    _encoded.clear();
    _changeParts.clear();
    _inlineChanges = {};
    for (std::size_t i = 0; i < _frame.changes.size(); ++i) {
        const wire::Bytes& part = _frame.changes[i];
        if (i + 1 == _frame.changes.size() && part.size() <= wire::kMaxInlineChangeBytes) _inlineChanges = part;
        else _changeParts.push_back(std::make_shared<const wire::Bytes>(wire::encode(wire::Changes{part})));
    }
    for (Server& server : _servers) {
        server.ready = false;
        server.tilesDone = !_frame.wantPixels || server.remote.tiles.empty();
        server.outcome = {};
        if (_frame.wantPixels) server.tiles.expect(_frame.number, server.remote.tiles);
        server.withViews = server.views != _frame.views;
        server.withTime = !server.time || *server.time != _frame.time;
        server.views = _frame.views;
        server.time = _frame.time;
        server.outcome.viewBytes = server.withViews ? _frame.views.size() : 0;
        server.nextPart = 0;
        server.frameSent = false;
    }
    for (Server& server : _servers) feed(server);
    if (!_error) frameProgress(now);
}

void ClusterClient::feed(Server& server) {
    while (!server.frameSent && !_error) {
        Link* control = link(server.control);
        if (control && control->output().size() >= kControlTarget) return;
        const bool last = server.nextPart == _changeParts.size();
        const bool sent = control && (last ? control->sendShared(MessageType::Frame,
                                                                 frameMessage(server.withViews, server.withTime))
                                           : control->sendShared(MessageType::Changes, _changeParts[server.nextPart]));
        if (!sent) return fail(fmt::format("{} does not take its data: too much is waiting for it", textOf(server)));
        if (last) server.frameSent = true;
        else ++server.nextPart;
    }
}

std::shared_ptr<const wire::Bytes> ClusterClient::frameMessage(bool withViews, bool withTime) {
    for (const EncodedFrame& encoded : _encoded)
        if (encoded.withViews == withViews && encoded.withTime == withTime) return encoded.payload;
    wire::Frame message;
    message.number = _frame.number;
    message.wantPixels = _frame.wantPixels;
    message.fromNothing = _frame.fromNothing;
    if (withTime) message.time = _frame.time;
    if (withViews) message.views = _frame.views;
    message.changes = _inlineChanges;
    _encoded.push_back({withViews, withTime, std::make_shared<const wire::Bytes>(wire::encode(message))});
    return _encoded.back().payload;
}

Result<void> ClusterClient::message(Server& server, MessageType type, std::span<const std::byte> payload, TimePoint now) {
    switch (type) {
        case MessageType::Ready: {
            const auto ready = wire::decode<wire::Ready>(payload);
            if (!ready) return ready.error();
            if (_phase != Phase::Drawing || server.ready || ready->frame != static_cast<std::uint16_t>(_frame.number))
                return failure(fmt::format("it is ready with frame {}, which was not asked for", ready->frame));
            server.ready = true;
            server.readyAt = now;
            server.outcome.ready = *ready;
            frameProgress(now);
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
                const auto found = _frame.blobs.find(hash);
                if (found == _frame.blobs.end())
                    return failure(fmt::format("it asks for blob {}, which is not in this frame", toHex(hash)));
                server.sender.addBlob(hash, found->second);
            }
            if (Link* bulk = link(server.bulk)) server.sender.fill(*bulk);
            return {};
        }
        case MessageType::TileData: {
            const auto data = wire::decode<wire::TileData>(payload);
            if (!data) return data.error();
            if (_phase != Phase::Drawing || server.tilesDone) return failure("it sends pixels that nobody asked for");
            const auto done = server.tiles.part(*data);
            if (!done) return done.error();
            if (*done) {
                server.tilesDone = true;
                server.outcome.tiles = server.tiles.take();
                frameProgress(now);
            }
            return {};
        }
        case MessageType::DigestReply: {
            auto reply = wire::decode<wire::DigestReply>(payload);
            if (!reply) return reply.error();
            if (_phase != Phase::Digests || &server != &_servers[_digestServer])
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
            if (std::all_of(_servers.begin(), _servers.end(), [](const Server& one) { return one.explanation.has_value(); }))
                _phase = Phase::Idle;
            return {};
        }
        default:
            return failure(fmt::format("a {} message has no meaning here", wire::ruleOf(type).name));
    }
}

void ClusterClient::frameProgress(TimePoint now) {
    if (!_swapped) {
        for (const Server& server : _servers)
            if (!server.ready) return;
        for (std::size_t i = 0; i < _servers.size() && !_mismatch; ++i)
            if (_servers[i].outcome.ready.digest != _frame.digest) _mismatch = i;
        if (_mismatch) {
            _phase = Phase::Idle;  // nothing is shown: the caller asks what differs
            return;
        }
        const auto swap = std::make_shared<const wire::Bytes>(wire::encode(wire::Swap{_frame.number}));
        for (std::size_t i = 0; i < _servers.size(); ++i) {
            Link* control = link(_servers[i].control);
            if (!control || !control->sendShared(MessageType::Swap, swap))
                return fail(fmt::format("{} does not take its data: too much is waiting for it", textOf(i)));
            _servers[i].outcome.wait = now - _servers[i].readyAt;
        }
        _swapped = true;
    }
    for (const Server& server : _servers)
        if (!server.tilesDone) return;
    for (Server& server : _servers) {
        const std::uint64_t sent = bytesSent(server);
        server.outcome.bytes = sent - server.bytesBefore;
        server.bytesBefore = sent;
    }
    _frame.blobs.clear();
    _phase = Phase::Idle;
}

std::vector<std::string> ClusterClient::waitingFor() const {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        const Server& server = _servers[i];
        const bool done = _phase == Phase::Connecting ? server.controlOpen && server.bulkOpen
                          : _phase == Phase::Drawing  ? server.ready && server.tilesDone
                          : _phase == Phase::Digests  ? i != _digestServer
                          : _phase == Phase::Explaining ? server.explanation.has_value()
                                                        : true;
        if (!done) names.push_back(textOf(i));
    }
    return names;
}

std::vector<ServerOutcome> ClusterClient::takeOutcome() {
    std::vector<ServerOutcome> outcomes;
    for (Server& server : _servers) outcomes.push_back(std::exchange(server.outcome, {}));
    return outcomes;
}

void ClusterClient::beginDigestQuery(std::size_t server, const wire::DigestQuery& query) {
    UMBRIEL_ASSERT(_phase == Phase::Idle, "one request at a time");
    _phase = Phase::Digests;
    _digestServer = server;
    Link* control = link(_servers[server].control);
    if (!control || !control->send(query)) fail(fmt::format("{} cannot be asked for its digests", textOf(server)));
}

void ClusterClient::beginExplain() {
    UMBRIEL_ASSERT(_phase == Phase::Idle, "one request at a time");
    _phase = _servers.empty() ? Phase::Idle : Phase::Explaining;
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        _servers[i].explanation.reset();
        Link* control = link(_servers[i].control);
        if (!control || !control->send(wire::Explain{}))
            return fail(fmt::format("{} cannot be asked to explain", textOf(i)));
    }
}

std::vector<std::string> ClusterClient::takeExplanations() {
    std::vector<std::string> texts;
    for (Server& server : _servers) texts.push_back(std::exchange(server.explanation, std::nullopt).value_or(""));
    return texts;
}

const wire::Hello& ClusterClient::serverHello(std::size_t server) const {
    const auto found = _peers.find(_servers[server].control);
    UMBRIEL_ASSERT(found != _peers.end() && found->second.link->peerHello(), "only a connected server has said hello");
    return *found->second.link->peerHello();
}

void ClusterClient::leave(const std::string& reason) {
    for (auto& [id, peer] : _peers) {
        peer.link->close(reason);
        drop(id);
    }
    if (!_error) _error = failure(reason);
}

void ClusterClient::fail(std::string message) { fail(failure(std::move(message))); }

void ClusterClient::fail(Error error) {
    if (_error) return;
    _error = std::move(error);
    for (auto& [id, peer] : _peers) {
        peer.link->close(_error->message);
        drop(id);
    }
}

void ClusterClient::drop(ConnectionId connection) {
    const auto found = _peers.find(connection);
    if (found == _peers.end() || found->second.closing) return;
    found->second.closing = true;
    _actions.push_back({Action::Kind::Close, connection, 0, {}, 0});
}

}  // namespace umbriel::protocol
