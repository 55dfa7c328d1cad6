#include "common/net/memory_pump.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/base/assert.h"

namespace umbriel::net {

using protocol::Action;
using protocol::ConnectionId;
using protocol::Endpoint;

namespace {

// How long dialling a host that does not answer takes, and how often it is tried meanwhile.
constexpr auto kDialTimeout = std::chrono::seconds(1);
constexpr auto kDialRepeat = std::chrono::milliseconds(200);
constexpr std::uint64_t kPacedPiecesPerSecond = 20;

}  // namespace

MemoryNetwork::MemoryNetwork(const Options& options) : _options(options), _random(options.seed) {}

// SplitMix64 (Steele, Lea, Flood 2014).
std::uint64_t MemoryNetwork::random(std::uint64_t below) {
    std::uint64_t z = (_random += 0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return (z ^ (z >> 31)) % below;
}

Duration MemoryNetwork::latency() {
    const auto span = static_cast<std::uint64_t>((_options.maxLatency - _options.minLatency).count());
    return _options.minLatency + Duration(static_cast<Duration::rep>(random(span + 1)));
}

void MemoryNetwork::at(TimePoint when, std::function<void()> what) {
    _events.emplace(Key{when, _sequence++}, std::move(what));
}

void MemoryNetwork::add(Endpoint& endpoint, std::function<void()> hook) {
    _hosts[&endpoint].hook = std::move(hook);
    _order.push_back(&endpoint);
    at(_now, [this, &endpoint] {
        if (_hosts.count(&endpoint)) turn(endpoint);
    });
}

void MemoryNetwork::listen(Endpoint& endpoint, const std::string& host, std::uint16_t port) {
    _listeners[{host, port}] = &endpoint;
}

void MemoryNetwork::remove(Endpoint& endpoint) {
    const auto connections = _hosts[&endpoint].connections;
    _hosts.erase(&endpoint);
    std::erase(_order, &endpoint);
    std::erase_if(_listeners, [&](const auto& entry) { return entry.second == &endpoint; });
    for (const auto& [id, pipe] : connections) {
        const auto found = _pipes.find(pipe);
        if (found == _pipes.end()) continue;
        const int side = sideOf(found->second, &endpoint, id);
        found->second.ends[side].gone = true;
        hangUp(pipe, side);
    }
}

void MemoryNetwork::setSilent(Endpoint& endpoint, bool silent) {
    _hosts[&endpoint].silent = silent;
    resume(endpoint);
}

void MemoryNetwork::setPaused(Endpoint& endpoint, bool paused) {
    _hosts[&endpoint].paused = paused;
    resume(endpoint);
}

void MemoryNetwork::resume(Endpoint& endpoint) {
    Host& host = _hosts[&endpoint];
    if (host.silent || host.paused) return;
    const auto held = std::exchange(host.held, {});
    for (const auto& what : held) what();
    turn(endpoint);
}

void MemoryNetwork::reach(Endpoint* endpoint, std::function<void()> what) {
    const auto host = _hosts.find(endpoint);
    if (host != _hosts.end() && (host->second.silent || host->second.paused))
        host->second.held.push_back(std::move(what));
    else
        what();
}

TimePoint MemoryNetwork::HostClock::local(TimePoint network) const {
    if (rate == 1.0) return network + ahead;
    return network + ahead + Duration(std::llround((rate - 1.0) * static_cast<double>((network - since).count())));
}

// The first moment at which the clock shows that time, or later.
TimePoint MemoryNetwork::HostClock::network(TimePoint time) const {
    if (time == TimePoint::max()) return time;
    if (rate == 1.0) return time - ahead;
    TimePoint network = since + Duration(std::llround(static_cast<double>((time - ahead - since).count()) / rate));
    while (local(network) < time) network += Duration(1);
    return network;
}

MemoryNetwork::HostClock MemoryNetwork::clockOf(const Endpoint* endpoint) const {
    const auto host = _hosts.find(endpoint);
    return host == _hosts.end() ? HostClock{} : host->second.clock;
}

void MemoryNetwork::setClock(Endpoint& endpoint, Duration ahead, double rate) {
    _hosts[&endpoint].clock = {_now, ahead, rate};
}

void MemoryNetwork::reset(Endpoint& endpoint) {
    const auto& connections = _hosts[&endpoint].connections;
    if (connections.empty()) return;
    const std::uint64_t pipe = connections[random(connections.size())].second;
    _pipes[pipe].cut = true;
    for (const int side : {0, 1}) endReaches(pipe, side, "connection reset by peer");
}

void MemoryNetwork::resetHalf(Endpoint& endpoint) {
    const auto connections = _hosts[&endpoint].connections;
    for (const auto& [id, pipe] : connections) _pipes[pipe].cut = true;
    for (const auto& [id, pipe] : connections)
        endReaches(pipe, 1 - sideOf(_pipes[pipe], &endpoint, id), "connection reset by peer");
}

void MemoryNetwork::poke(Endpoint& endpoint) {
    turn(endpoint);
}

int MemoryNetwork::sideOf(const Pipe& pipe, const Endpoint* endpoint, ConnectionId id) const {
    return pipe.ends[0].endpoint == endpoint && pipe.ends[0].id == id ? 0 : 1;
}

ConnectionId MemoryNetwork::attach(Endpoint& endpoint, std::uint64_t pipe) {
    const ConnectionId id = _nextConnection++;
    _hosts[&endpoint].connections.emplace_back(id, pipe);
    return id;
}

void MemoryNetwork::setPace(Endpoint& endpoint, std::size_t nth, std::uint64_t bytesPerSecond) {
    _pipes[_hosts[&endpoint].connections.at(nth).second].pace = bytesPerSecond;
}

void MemoryNetwork::turn(Endpoint& endpoint) {
    Host& host = _hosts[&endpoint];
    if (host.paused) return;
    if (host.hook) host.hook();
    while (const auto action = endpoint.nextAction()) {
        if (action->kind == Action::Kind::Close) {
            const auto found = std::find_if(host.connections.begin(), host.connections.end(),
                                            [&](const auto& one) { return one.first == action->connection; });
            if (found == host.connections.end()) continue;
            const std::uint64_t pipe = found->second;
            const int side = sideOf(_pipes[pipe], &endpoint, action->connection);
            // A pulled cable lets no last words out.
            if (protocol::SendQueue* queue = endpoint.output(action->connection); queue && !host.silent)
                for (const auto span : queue->gather()) transmit(pipe, side, {span.begin(), span.end()});
            hangUp(pipe, side);
            endOf(pipe, side, "the connection was closed");
            continue;
        }
        at(_now + latency(), [this, &endpoint, action = *action, since = _now] {
            reach(&endpoint, [this, &endpoint, action, since] { connect(endpoint, action, since); });
        });
    }
    while (endpoint.nextOutput()) {
    }
    if (host.silent) return;
    // All of them: a window may have opened, a silence may be over.
    const auto connections = host.connections;
    for (const auto& [id, pipe] : connections) {
        protocol::SendQueue* queue = endpoint.output(id);
        const int side = sideOf(_pipes[pipe], &endpoint, id);
        while (queue && !queue->empty()) {
            const std::size_t underWay = _pipes[pipe].ends[side].underWay;
            if (_options.window > 0 && underWay >= _options.window) break;
            const std::size_t room = _options.window > 0 ? _options.window - underWay : ~std::size_t{0};
            std::vector<std::byte> bytes;
            for (const auto span : queue->gather()) bytes.insert(bytes.end(), span.begin(), span.end());
            if (bytes.size() > room) bytes.resize(room);
            queue->consumed(bytes.size());
            transmit(pipe, side, std::move(bytes));
            endpoint.written(id, now(endpoint));
            queue = endpoint.output(id);
        }
    }
}

void MemoryNetwork::connect(Endpoint& endpoint, const Action& action, TimePoint since) {
    if (!_hosts.count(&endpoint)) return;
    const auto listener = _listeners.find({action.host, action.port});
    if (listener == _listeners.end()) {
        endpoint.dialFailed(action.tag, failure("connection refused"), now(endpoint));
    } else if (_hosts[listener->second].silent) {
        // No answer: repeated for a while, as TCP does.
        if (_now - since < kDialTimeout)
            return at(_now + kDialRepeat, [this, &endpoint, action, since] {
                reach(&endpoint, [this, &endpoint, action, since] { connect(endpoint, action, since); });
            });
        endpoint.dialFailed(action.tag, failure("no answer"), now(endpoint));
    } else {
        const std::uint64_t number = _nextPipe++;
        Endpoint* other = listener->second;
        Pipe& pipe = _pipes[number];
        pipe.ends[0].endpoint = &endpoint;
        pipe.ends[0].id = attach(endpoint, number);
        pipe.ends[1].endpoint = other;
        const ConnectionId theirs = pipe.ends[1].id = attach(*other, number);
        endpoint.opened(pipe.ends[0].id, action.tag, now(endpoint));
        reach(other, [this, other, theirs] {
            if (!_hosts.count(other)) return;
            other->opened(theirs, 0, now(*other));
            turn(*other);
        });
    }
    turn(endpoint);
}

void MemoryNetwork::transmit(std::uint64_t number, int from, std::vector<std::byte> bytes) {
    End& end = _pipes[number].ends[from];
    end.underWay += bytes.size();
    const auto pace = _pipes[number].pace;
    if (pace && *pace == 0) return;
    std::size_t offset = 0;
    while (offset < bytes.size()) {
        std::size_t size = bytes.size() - offset;
        if (_options.splitReads && random(2) == 0) size = std::min<std::size_t>(size, 1 + random(64));
        end.busyUntil = std::max(end.busyUntil, _now + latency());
        if (pace) {
            size = std::min<std::size_t>(size, std::max<std::uint64_t>(*pace / kPacedPiecesPerSecond, 1));
            end.busyUntil += std::chrono::nanoseconds(std::chrono::seconds(1)) * size / *pace;
        }
        const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(offset);
        at(end.busyUntil,
           [this, number, from, piece = std::vector<std::byte>(begin, begin + static_cast<std::ptrdiff_t>(size))] {
               deliver(number, 1 - from, piece);
           });
        offset += size;
    }
}

void MemoryNetwork::deliver(std::uint64_t number, int to, const std::vector<std::byte>& bytes) {
    const auto found = _pipes.find(number);
    if (found == _pipes.end() || found->second.ends[to].gone || found->second.cut) return;
    const End end = found->second.ends[to];
    if (!end.endpoint) {
        found->second.answer->insert(found->second.answer->end(), bytes.begin(), bytes.end());
        return;
    }
    const auto host = _hosts.find(end.endpoint);
    if (host == _hosts.end()) return;
    if (host->second.silent || host->second.paused) {
        host->second.held.push_back([this, number, to, bytes] { deliver(number, to, bytes); });
        return;
    }
    _delivered += bytes.size();
    End& sender = found->second.ends[1 - to];
    sender.underWay -= bytes.size();
    hand(end, bytes);
    turn(*end.endpoint);
    if (_options.window > 0 && sender.endpoint && !sender.gone && _hosts.count(sender.endpoint)) turn(*sender.endpoint);
}

// As a pump of sockets does: what has room is put there.
void MemoryNetwork::hand(const End& end, std::span<const std::byte> bytes) {
    std::array<std::span<std::byte>, 4> places;
    std::size_t placed = 0;
    for (std::size_t i = 0, count = end.endpoint->room(end.id, places); i < count && placed < bytes.size(); ++i) {
        const std::size_t size = std::min(places[i].size(), bytes.size() - placed);
        std::copy_n(bytes.data() + placed, size, places[i].data());
        placed += size;
    }
    if (placed > 0) end.endpoint->placed(end.id, placed, now(*end.endpoint));
    if (placed < bytes.size()) end.endpoint->received(end.id, bytes.subspan(placed), now(*end.endpoint));
}

// The other side sees the end after what was sent before it.
void MemoryNetwork::hangUp(std::uint64_t number, int from) {
    if (_pipes[number].cut) return;
    End& end = _pipes[number].ends[from];
    end.busyUntil = std::max(end.busyUntil, _now + latency());
    const auto host = _hosts.find(end.endpoint);
    if (host != _hosts.end() && host->second.silent) {
        host->second.held.push_back(
            [this, number, from] { endReaches(number, 1 - from, "the connection was closed"); });
        return;
    }
    at(end.busyUntil, [this, number, from] { endReaches(number, 1 - from, "the connection was closed"); });
}

void MemoryNetwork::endReaches(std::uint64_t number, int side, const std::string& reason) {
    reach(_pipes[number].ends[side].endpoint, [this, number, side, reason] { endOf(number, side, reason); });
}

void MemoryNetwork::endOf(std::uint64_t number, int side, const std::string& reason) {
    const auto found = _pipes.find(number);
    if (found == _pipes.end() || found->second.ends[side].gone) return;
    const End end = found->second.ends[side];
    if (!end.endpoint) {
        found->second.ends[side].gone = true;
        *found->second.closed = true;
        return;
    }
    const auto host = _hosts.find(end.endpoint);
    found->second.ends[side].gone = true;
    if (host == _hosts.end()) return;
    std::erase_if(host->second.connections, [&](const auto& one) { return one.first == end.id; });
    end.endpoint->closed(end.id, reason, now(*end.endpoint));
    turn(*end.endpoint);
    // The far side learns of it as well when it has not ended itself.
    if (const auto again = _pipes.find(number); again != _pipes.end() && !again->second.ends[1 - side].gone)
        hangUp(number, side);
}

MemoryNetwork::Stranger MemoryNetwork::dial(const std::string& host, std::uint16_t port) {
    Stranger stranger;
    stranger._network = this;
    stranger._pipe = _nextPipe++;
    stranger._answer = std::make_shared<std::vector<std::byte>>();
    stranger._closed = std::make_shared<bool>(false);
    const auto listener = _listeners.find({host, port});
    UMBRIEL_ASSERT(listener != _listeners.end(), "nobody listens there");
    Pipe& pipe = _pipes[stranger._pipe];
    pipe.answer = stranger._answer;
    pipe.closed = stranger._closed;
    pipe.ends[1] = {listener->second, attach(*listener->second, stranger._pipe)};
    listener->second->opened(pipe.ends[1].id, 0, now(*listener->second));
    turn(*listener->second);
    return stranger;
}

void MemoryNetwork::Stranger::send(std::span<const std::byte> bytes) {
    _network->transmit(_pipe, 0, {bytes.begin(), bytes.end()});
}

void MemoryNetwork::Stranger::close() {
    _network->hangUp(_pipe, 0);
}

bool MemoryNetwork::step(TimePoint limit) {
    TimePoint next = _events.empty() ? TimePoint::max() : _events.begin()->first.first;
    Endpoint* due = nullptr;
    for (Endpoint* endpoint : _order) {
        if (_hosts[endpoint].paused) continue;
        if (const TimePoint deadline = std::max(clockOf(endpoint).network(endpoint->deadline()), _now);
            deadline < next) {
            next = deadline;
            due = endpoint;
        }
    }
    if (next > limit) {
        _now = limit;
        return false;
    }
    _now = next;
    if (due) {
        due->advance(now(*due));
        turn(*due);
        return true;
    }
    const auto what = std::move(_events.begin()->second);
    _events.erase(_events.begin());
    what();
    return true;
}

bool MemoryNetwork::runUntil(const std::function<bool()>& condition, Duration limit) {
    const TimePoint end = _now + limit;
    while (!condition())
        if (!step(end)) return condition();
    return true;
}

std::size_t MemoryNetwork::queued(Endpoint& endpoint) {
    std::size_t sum = 0;
    for (const auto& [id, pipe] : _hosts[&endpoint].connections)
        if (const protocol::SendQueue* queue = endpoint.output(id)) sum += queue->size();
    return sum;
}

void MemoryNetwork::run(Duration time) {
    runUntil([] { return false; }, time);
}

}  // namespace umbriel::net
