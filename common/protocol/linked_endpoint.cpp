#include "common/protocol/linked_endpoint.h"

#include <algorithm>
#include <utility>

#include "common/base/host_port.h"

namespace umbriel::protocol {

void LinkedEndpoint::received(ConnectionId connection, std::span<const std::byte> bytes, TimePoint now) {
    Peer* found = peer(connection);
    if (!found || found->closing) return;
    found->link.received(bytes, now);
    drain(connection, *found, now);
    handled(now);
}

std::size_t LinkedEndpoint::room(ConnectionId connection, std::span<std::span<std::byte>> places) {
    Peer* found = peer(connection);
    std::size_t left = found && !found->closing ? found->link.moreToCome() : 0;
    if (left == 0) return 0;
    const std::size_t count = roomForMore(connection, *found, places);
    for (std::size_t i = 0; i < count; ++i) {
        if (left == 0) return i;
        places[i] = places[i].first(std::min(left, places[i].size()));
        left -= places[i].size();
    }
    return count;
}

void LinkedEndpoint::placed(ConnectionId connection, std::size_t count, TimePoint now) {
    Peer& found = *peer(connection);
    found.link.placed(count, now);
    morePlaced(connection, found, count, now);
    drain(connection, found, now);
    handled(now);
}

void LinkedEndpoint::closed(ConnectionId connection, const std::string& reason, TimePoint now) {
    Peer* found = peer(connection);
    if (!found) return;
    found->link.lost(reason);
    drain(connection, *found, now);
    _peers.erase(connection);
    handled(now);
}

std::optional<Action> LinkedEndpoint::nextAction() {
    if (_actions.empty()) return std::nullopt;
    Action action = std::move(_actions.front());
    _actions.pop_front();
    return action;
}

SendQueue* LinkedEndpoint::output(ConnectionId connection) {
    Link* found = link(connection);
    return found ? &found->output() : nullptr;
}

void LinkedEndpoint::adopt(ConnectionId connection, const LinkOptions& options, wire::Hello mine, std::uint64_t tag,
                           TimePoint now) {
    Link& link = _peers.try_emplace(connection, options, std::move(mine), tag, now).first->second.link;
    if (const auto dialled = _dialled.find(tag); dialled != _dialled.end()) link.setAddress(dialled->second);
    link.output().listIn(_outputs, connection);
    _linkDeadline = std::min(_linkDeadline, link.deadline());
}

bool LinkedEndpoint::admits(std::size_t most) {
    if (_peers.size() < most) return true;
    if (_peers.size() >= 2 * most) return false;  // those that were told to go have not gone yet
    // Pumps number connections as they come.
    for (auto& [id, peer] : _peers) {
        if (peer.closing || peer.tag != 0 || peer.link.peerHello()) continue;
        peer.link.close("it said nothing, and others want its place");
        drop(id);
        return true;
    }
    return false;
}

void LinkedEndpoint::decline(ConnectionId connection) {
    _actions.push_back({Action::Kind::Close, connection, 0, {}, 0});
}

void LinkedEndpoint::drop(ConnectionId connection) {
    Peer* found = peer(connection);
    if (found && !std::exchange(found->closing, true)) decline(connection);
}

void LinkedEndpoint::dropAll(const std::string& reason) {
    for (auto& [id, peer] : _peers) {
        peer.link.close(reason);
        drop(id);
    }
}

void LinkedEndpoint::dial(std::uint64_t tag, const std::string& host, std::uint16_t port) {
    _dialled[tag] = hostPortText(host, port);
    _actions.push_back({Action::Kind::Dial, 0, tag, host, port});
}

LinkedEndpoint::Peer* LinkedEndpoint::peer(ConnectionId connection) {
    const auto found = _peers.find(connection);
    return found == _peers.end() ? nullptr : &found->second;
}

const LinkedEndpoint::Peer* LinkedEndpoint::peer(ConnectionId connection) const {
    const auto found = _peers.find(connection);
    return found == _peers.end() ? nullptr : &found->second;
}

Link* LinkedEndpoint::link(ConnectionId connection) {
    Peer* found = peer(connection);
    return found ? &found->link : nullptr;
}

void LinkedEndpoint::advanceLinks(TimePoint now) {
    for (auto& [id, peer] : _peers) peer.link.advance(now);
    for (auto& [id, peer] : _peers) drain(id, peer, now);
    _linkDeadline = TimePoint::max();
    for (const auto& [id, peer] : _peers) _linkDeadline = std::min(_linkDeadline, peer.link.deadline());
}

std::optional<ConnectionId> LinkedEndpoint::nextOutput() {
    while (!_outputs.empty()) {
        const ConnectionId id = _outputs.front();
        _outputs.pop_front();
        SendQueue* queue = output(id);
        if (!queue) continue;
        queue->takenFromList();
        return id;
    }
    return std::nullopt;
}

// Nothing that an event leads to takes a peer away: that is closed() alone.
void LinkedEndpoint::drain(ConnectionId connection, Peer& peer, TimePoint now) {
    for (;;) {
        const LinkEvent event = peer.link.next();
        switch (event.kind) {
            case LinkEvent::Kind::None:
                return;
            case LinkEvent::Kind::Hello:
                greeted(connection, peer, now);
                break;
            case LinkEvent::Kind::Open:
                _linkDeadline = std::min(_linkDeadline, peer.link.deadline());
                linkOpen(connection, peer, now);
                break;
            case LinkEvent::Kind::Message:
                message(connection, peer, event.type, event.payload, now);
                break;
            case LinkEvent::Kind::More:
                more(connection, peer, event.payload, now);
                break;
            case LinkEvent::Kind::Closed: {
                const std::string reason = peer.link.reason();
                drop(connection);
                linkClosed(connection, peer, reason, now);
                break;
            }
        }
    }
}

}  // namespace umbriel::protocol
