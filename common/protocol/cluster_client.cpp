#include "common/protocol/cluster_client.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/host_port.h"
#include "common/protocol/handshake.h"

namespace umbriel::protocol {

using wire::MessageType;

namespace {

// Exchanges of clocks at a session's beginning, one after the other.
constexpr std::size_t kFirstExchanges = 8;
// Incidents kept for a caller that does not ask.
constexpr std::size_t kMaxIncidents = 256;

}  // namespace

ClusterClient::ClusterClient(ClusterClientOptions options, TimePoint now)
    : _options(std::move(options)),
      _phaseStart(now),
      _history(_options.historyBytes, _options.historyFrames),
      _pacing(_options.policy),
      _random(_options.token.low ^ _options.token.high) {
    UMBRIEL_ASSERT(_options.latency == 0 || _options.latency == 1, "a server takes two frames at once");
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
        if (!_servers[i].remote.host.empty()) dialServer(i, false);
    if (_servers.empty()) _phase = Phase::Idle;
}

void ClusterClient::dialServer(std::size_t index, bool bulk) {
    Server& server = _servers[index];
    if (!bulk) server.dialling = true;
    dial(tagOf({index, bulk}), server.remote.host, server.remote.port);
}

std::string ClusterClient::textOf(std::size_t index) const {
    const Server& server = _servers[index];
    std::string name = server.remote.name;
    if (const wire::Hello* hello = serverHello(index)) name = hello->name;
    if (name.empty()) name = server.knownName;
    if (name.empty() && server.remote.host.empty()) return fmt::format("server {} of {}", index + 1, _servers.size());
    std::string text = name.empty() ? "server" : fmt::format("server '{}'", name);
    if (!server.remote.host.empty()) text += " at " + hostPortText(server.remote.host, server.remote.port);
    return text;
}

void ClusterClient::opened(ConnectionId connection, std::uint64_t dialTag, TimePoint now) {
    if (_error || !admits(4 * _servers.size() + 17)) return decline(connection);
    wire::Hello hello = _options.identity;
    LinkOptions linkOptions = _options.link;
    if (dialTag != 0) {
        const auto [index, bulk] = placeOf(dialTag);
        Server& server = _servers[index];
        Session& session = server.session;
        if (!bulk) server.dialling = false;
        // Of a session that ended while this connection was being made.
        if (bulk ? !session.controlOpen || session.bulk != 0 : session.control != 0) return decline(connection);
        if (!bulk) session.epoch = _options.epoch + server.sessions++;
        hello.channel = bulk ? wire::Channel::Bulk : wire::Channel::Control;
        hello.wantedName = server.remote.name;
        hello.epoch = session.epoch;
        if (_phase != Phase::Connecting) linkOptions.handshakeTimeout = _options.rejoinHandshake;
        (bulk ? session.bulk : session.control) = connection;
    } else {
        hello.epoch = _options.epoch + _accepted++;
    }
    adopt(connection, linkOptions, std::move(hello), dialTag, now);
}

void ClusterClient::dialFailed(std::uint64_t dialTag, const Error& reason, TimePoint now) {
    const auto [index, bulk] = placeOf(dialTag);
    Server& server = _servers[index];
    if (!bulk) server.dialling = false;
    if (reason.kind == Error::Kind::BadInput) {
        const std::string message = fmt::format("{}: {}", textOf(index), reason.message);
        return fail(badInput(message));
    }
    const bool changed = server.lastFailure != reason.message;
    server.lastFailure = reason.message;
    if (_phase == Phase::Connecting) {
        server.redialBulk = bulk;
        server.redialAt = now + _options.redialAfter;
    } else if (bulk) {
        if (server.session.controlOpen)
            lose(index, fmt::format("the bulk connection to {} cannot be opened: {}", textOf(index), reason.message),
                 now);
    } else {
        if (changed)
            report(ServerIncident::Kind::Refused, index,
                   fmt::format("{} cannot be reached: {}", textOf(index), reason.message));
        redialLater(server, now);
    }
    progress(now);
}

void ClusterClient::written(ConnectionId connection, TimePoint) {
    Peer* found = peer(connection);
    if (!found || found->tag == 0) return;
    Server& server = _servers[placeOf(found->tag).server];
    if (connection == server.session.bulk)
        server.session.sender.fill(found->link);
    else if (connection == server.session.control)
        feed(server);
}

void ClusterClient::advance(TimePoint now) {
    advanceLinks(now);
    if (_error) return;
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        Server& server = _servers[i];
        if (!server.redialAt || now < *server.redialAt) continue;
        server.redialAt.reset();
        dialServer(i, std::exchange(server.redialBulk, false));
    }
    if (_phase == Phase::Connecting && now >= _phaseStart + _options.connectTimeout) connectingTimedOut();
    if (!_running.empty() && _options.frameTimeout.count() > 0 &&
        now >= _running.front().start + _options.frameTimeout) {
        std::string names;
        for (const std::string& name : waitingFor()) names += (names.empty() ? "" : ", ") + name;
        return fail(fmt::format("frame {} is not drawn within {:.1f} s: still waiting for {}",
                                _running.front().frame.number, toSeconds(_options.frameTimeout), names));
    }
    progress(now);
}

void ClusterClient::connectingTimedOut() {
    const auto connected = [](const Server& server) { return server.session.connected(); };
    if (_options.startIncomplete && std::any_of(_servers.begin(), _servers.end(), connected)) {
        _phase = Phase::Idle;
        for (std::size_t i = 0; i < _servers.size(); ++i) {
            Server& server = _servers[i];
            if (connected(server)) {
                server.session.waitedFor = true;
                continue;
            }
            server.whole = false;
            server.lost = true;
            report(ServerIncident::Kind::Lost, i, fmt::format("{} is not there at the start", textOf(i)));
        }
        return;
    }
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        const Server& server = _servers[i];
        if (connected(server)) continue;
        const double seconds = toSeconds(_options.connectTimeout);
        if (server.remote.host.empty())
            return fail(fmt::format("{} has not dialled within {:.1f} s", textOf(i), seconds));
        if (server.session.control != 0)
            return fail(fmt::format("{} does not complete the handshake within {:.1f} s", textOf(i), seconds));
        return fail(fmt::format("{} cannot be reached: {}; is umbriel-server running there?", textOf(i),
                                server.lastFailure.empty() ? "no answer" : server.lastFailure));
    }
}

TimePoint ClusterClient::deadline() const {
    TimePoint earliest = linkDeadline();
    if (_error) return earliest;
    for (const Server& server : _servers)
        if (server.redialAt) earliest = std::min(earliest, *server.redialAt);
    if (_phase == Phase::Connecting) earliest = std::min(earliest, _phaseStart + _options.connectTimeout);
    if (!_running.empty() && _options.frameTimeout.count() > 0)
        earliest = std::min(earliest, _running.front().start + _options.frameTimeout);
    if (const auto due = dueAt()) earliest = std::min(earliest, *due);
    return earliest;
}

void ClusterClient::message(ConnectionId, Peer& peer, MessageType type, std::span<const std::byte> payload,
                            TimePoint now) {
    const std::size_t server = placeOf(peer.tag).server;
    if (const auto done = answer(server, type, payload, now); !done)
        lose(server, fmt::format("{}: {}", textOf(server), done.error().message), now);
}

void ClusterClient::linkClosed(ConnectionId connection, Peer& peer, const std::string& reason, TimePoint now) {
    if (peer.tag == 0) return;
    const std::size_t server = placeOf(peer.tag).server;
    const Session& session = _servers[server].session;
    if (session.control != connection && session.bulk != connection) return;
    const RemoteServer& remote = _servers[server].remote;
    // Whoever took the call hung up: a tunnel whose end is not there yet, a server that is crowded or ends. As good as
    // nobody there.
    if (_phase == Phase::Connecting && !_error && !remote.host.empty() && !peer.link.peerHello() &&
        peer.link.wasLost()) {
        const bool bulk = session.bulk == connection;
        if (bulk)
            _servers[server].session.bulk = 0;
        else
            _servers[server].session = {};
        return dialFailed(tagOf({server, bulk}), failure("it closes the connection before it says hello"), now);
    }
    const std::string where = remote.host.empty() ? "" : hostPortText(remote.host, remote.port);
    // Without a hello the reason names the address already.
    const bool isNamed = where.empty() || reason.find(where) != std::string::npos;
    lose(server, isNamed ? reason : fmt::format("{} (at {})", reason, where), now);
}

void ClusterClient::lose(std::size_t index, const std::string& reason, TimePoint now) {
    if (_error) return;
    if (endsTheCluster()) return fail(reason);
    Server& server = _servers[index];
    const bool wasConnected = server.session.connected();
    const Session gone = std::exchange(server.session, {});
    sessionEnded(index, gone, reason);
    for (const ConnectionId id : {gone.control, gone.bulk}) {
        if (Link* one = link(id)) one->close(reason);
        drop(id);
    }
    for (Running& running : _running) {
        Part& part = running.parts[index];
        part.waitedFor = part.ready = part.sent = false;
        part.tilesDone = true;
    }
    if (_phase == Phase::Explaining && !server.explanation) server.explanation.emplace();
    if (_phase == Phase::Digests && index == _digestServer) {
        _digests = {};
        _phase = Phase::Idle;
    }
    if (wasConnected) {
        server.whole = false;
        server.lost = true;
        report(ServerIncident::Kind::Lost, index, reason);
    } else if (server.lastFailure != reason) {
        report(ServerIncident::Kind::Refused, index, reason);
    }
    server.lastFailure = reason;
    if (!server.remote.host.empty() && !server.dialling) redialLater(server, now);
}

// SplitMix64 (Steele, Lea, Flood 2014) for the jitter: servers that were lost together are not dialled together.
void ClusterClient::redialLater(Server& server, TimePoint now) {
    std::uint64_t z = (_random += 0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    z ^= z >> 31;
    const Duration pause = std::min(_options.rejoinMost, _options.rejoinLeast * (1 << std::min(server.failures, 16)));
    server.redialAt =
        now + pause / 2 + Duration(static_cast<Duration::rep>(z % static_cast<std::uint64_t>(pause.count() / 2 + 1)));
    server.redialBulk = false;
    ++server.failures;
}

void ClusterClient::report(ServerIncident::Kind kind, std::size_t server, std::string text,
                           std::optional<DigestDifference> difference) {
    if (_incidents.size() < kMaxIncidents) _incidents.push_back({kind, server, std::move(text), difference});
}

void ClusterClient::greeted(ConnectionId connection, Peer& peer, TimePoint) {
    const wire::Hello& hello = *peer.link.peerHello();
    wire::Hello mine = _options.identity;
    const bool dialledUs = peer.tag == 0;
    Place place;
    if (!dialledUs) {
        place = placeOf(peer.tag);
        mine.wantedName = _servers[place.server].remote.name;
    }
    if (const std::string reason = handshakeObjection(mine, hello); !reason.empty()) return peer.link.refuse(reason);
    if (dialledUs) {
        const auto found = placeFor(hello);
        if (!found) return peer.link.refuse(found.error().message);
        place = *found;
    }
    Server& server = _servers[place.server];
    Session& session = server.session;
    server.knownName = hello.name;
    if (dialledUs) {
        peer.tag = tagOf(place);
        (place.bulk ? session.bulk : session.control) = connection;
        if (!place.bulk) session.epoch = peer.link.ownHello().epoch;
    }
    peer.link.accept(session.epoch);
}

Result<ClusterClient::Place> ClusterClient::placeFor(const wire::Hello& hello) const {
    const std::string& name = _options.identity.name;
    if (hello.channel == wire::Channel::Bulk) {
        // It shows our token and its session's epoch.
        for (std::size_t i = 0; i < _servers.size(); ++i) {
            const Session& session = _servers[i].session;
            if (_servers[i].remote.host.empty() && session.controlOpen && session.bulk == 0 &&
                hello.token == _options.token && hello.epoch == session.epoch && hello.name == _servers[i].knownName)
                return Place{i, true};
        }
        return failure(fmt::format("client '{}' has no session that this bulk connection belongs to", name));
    }
    // Its own place, or the one it had, before one that anybody may take.
    std::optional<Place> free;
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        const Server& server = _servers[i];
        if (!server.remote.host.empty()) continue;
        const bool taken = server.session.control != 0;
        if (hello.name == (server.remote.name.empty() ? server.knownName : server.remote.name)) {
            if (taken) return failure(fmt::format("client '{}' has a server '{}' already", name, hello.name));
            return Place{i, false};
        }
        if (!taken && server.remote.name.empty() && (!free || server.knownName.empty())) {
            if (!free || !_servers[free->server].knownName.empty()) free = Place{i, false};
        }
    }
    if (free) return *free;
    return failure(fmt::format("client '{}' does not wait for a server '{}'", name, hello.name));
}

void ClusterClient::linkOpen(ConnectionId connection, Peer& peer, TimePoint now) {
    const auto [index, bulk] = placeOf(peer.tag);
    Server& server = _servers[index];
    Session& session = server.session;
    if (bulk) {
        session.bulkOpen = true;
        session.sender.fill(peer.link);
    } else {
        session.controlOpen = true;
        UMBRIEL_ASSERT(session.control == connection, "an open control connection belongs to its server");
        peer.link.send(wire::Assign{_options.wall, server.remote.tiles});
        peer.link.ask(now);
        if (!server.remote.host.empty()) dialServer(index, true);
    }
    if (session.connected()) sessionBegun(index);
    if (_phase != Phase::Connecting) return;
    if (!std::all_of(_servers.begin(), _servers.end(), [](const Server& one) { return one.session.connected(); }))
        return;
    _phase = Phase::Idle;
    for (Server& one : _servers) one.session.waitedFor = true;
}

void ClusterClient::heartbeat(std::size_t index, const wire::Heartbeat& heartbeat, TimePoint now) {
    Session& session = _servers[index].session;
    if (heartbeat.echo) {
        session.asked = false;
        session.clock.add({TimePoint(Duration(heartbeat.echo->sent)), TimePoint(Duration(heartbeat.echo->received)),
                           TimePoint(Duration(heartbeat.sent)), now});
        // The first ones quickly: the shortest way of several is what counts.
        if (session.clock.count() < kFirstExchanges)
            if (Link* control = link(session.control)) control->ask(now);
    }
    for (const wire::Heartbeat::Swap& swap : heartbeat.swaps)
        if (const auto time = session.clock.ours(TimePoint(Duration(swap.at)))) _skew.shown(swap.frame, index, *time);
}

void ClusterClient::askForClocks(TimePoint now) {
    for (Server& server : _servers) {
        if (!server.session.connected()) continue;
        server.session.asked = true;
        link(server.session.control)->ask(now);
    }
}

bool ClusterClient::waitsForClocks() const {
    return !_error &&
           std::any_of(_servers.begin(), _servers.end(), [](const Server& server) { return server.session.asked; });
}

std::uint64_t ClusterClient::bytesSent(const Server& server) const {
    std::uint64_t sum = 0;
    for (const ConnectionId id : {server.session.control, server.session.bulk})
        if (const Peer* found = peer(id)) sum += found->link.bytesSent();
    return sum;
}

void ClusterClient::assign(PixelSize wall, std::vector<std::vector<TileAssignment>> tiles) {
    UMBRIEL_ASSERT(_phase == Phase::Idle && _running.empty() && tiles.size() == _servers.size(),
                   "tiles change between requests, for every server");
    if (_error) return;
    _options.wall = wall;
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        Server& server = _servers[i];
        server.remote.tiles = std::move(tiles[i]);
        if (!server.session.controlOpen) continue;
        // In order with the frames before it that still wait for room.
        server.session.outbox.emplace_back(
            MessageType::Assign,
            std::make_shared<const wire::Bytes>(wire::encode(wire::Assign{wall, server.remote.tiles})));
        feed(server);
    }
}

bool ClusterClient::isWhole() const {
    return std::all_of(_servers.begin(), _servers.end(), [](const Server& server) { return server.whole; });
}

bool ClusterClient::wantsSnapshot() const {
    return std::any_of(_servers.begin(), _servers.end(), [](const Server& server) {
        return server.session.connected() && server.session.needsSnapshot && server.session.sent.empty();
    });
}

bool ClusterClient::wantsDigests() const {
    return std::any_of(_servers.begin(), _servers.end(), [](const Server& server) {
        const auto& comparing = server.session.comparing;
        return server.session.connected() && comparing && comparing->frame == 0 && server.session.sent.empty();
    });
}

std::vector<std::string> ClusterClient::waitingFor() const {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        const Server& server = _servers[i];
        bool done = true;
        if (_phase == Phase::Connecting)
            done = server.session.connected();
        else if (_phase == Phase::Digests)
            done = i != _digestServer;
        else if (_phase == Phase::Explaining)
            done = server.explanation.has_value();
        else if (!_running.empty())
            if (const Part& part = _running.front().parts[i]; part.waitedFor) done = part.ready && part.tilesDone;
        if (!done) names.push_back(textOf(i));
    }
    return names;
}

void ClusterClient::beginDigestQuery(std::size_t index, const wire::DigestQuery& query) {
    UMBRIEL_ASSERT(_phase == Phase::Idle && _running.empty(), "one request at a time");
    if (_error) return;
    _digests = {};
    if (!_servers[index].session.connected()) return;
    _phase = Phase::Digests;
    _digestServer = index;
    if (!link(_servers[index].session.control)->send(query))
        fail(fmt::format("{} cannot be asked for its digests", textOf(index)));
}

void ClusterClient::beginExplain() {
    UMBRIEL_ASSERT(_phase == Phase::Idle && _running.empty(), "one request at a time");
    if (_error) return;
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        Server& server = _servers[i];
        server.explanation.reset();
        if (!server.session.connected() || !server.session.sent.empty()) {
            server.explanation.emplace();
            continue;
        }
        _phase = Phase::Explaining;
        if (!link(server.session.control)->send(wire::Explain{}))
            return fail(fmt::format("{} cannot be asked to explain", textOf(i)));
    }
}

std::vector<std::string> ClusterClient::takeExplanations() {
    std::vector<std::string> texts;
    for (Server& server : _servers) texts.push_back(std::exchange(server.explanation, std::nullopt).value_or(""));
    return texts;
}

const wire::Hello* ClusterClient::serverHello(std::size_t server) const {
    if (!_servers[server].session.controlOpen) return nullptr;
    const Peer* found = peer(_servers[server].session.control);
    return found && found->link.peerHello() ? &*found->link.peerHello() : nullptr;
}

void ClusterClient::leave(const std::string& reason) {
    dropAll(reason);
    if (!_error) _error = failure(reason);
}

void ClusterClient::fail(std::string message) {
    fail(failure(std::move(message)));
}

void ClusterClient::fail(Error error) {
    if (_error) return;
    _error = std::move(error);
    dropAll(_error->message);
}

}  // namespace umbriel::protocol
