#include "client/bake/shard_coordinator.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "common/base/assert.h"

namespace umbriel {

using protocol::JobPeer;
using wire::JobStatus;

namespace {

// Results on their way at once: they are in memory until they are on the disk.
constexpr int kFetches = 4;
constexpr int kMostStrikes = 3;
constexpr int kMostFailures = 3;
// A shard that ends this many sessions is not given to another one.
constexpr int kMostLosses = 16;
// A shard is tried elsewhere as well when it takes so many times as long as usual, and at least so long.
constexpr int kSlowFactor = 3;
constexpr Duration kSlowLeast = std::chrono::seconds(2);
constexpr Duration kIdleTick = std::chrono::milliseconds(250);
constexpr std::size_t kDurations = 31;

}  // namespace

ShardCoordinator::ShardCoordinator(CoordinatorOptions options, std::size_t servers, TimePoint now)
    : _options(std::move(options)), _servers(servers), _lastUsable(now), _lastProgress(now), _now(now) {}

bool ShardCoordinator::isAudited(std::size_t shard) const {
    const std::array<std::uint64_t, 2> key{_options.auditSeed, shard};
    const std::uint64_t drawn = hash64(std::as_bytes(std::span(key))) >> 11;
    return static_cast<double>(drawn) * 0x1p-53 < _options.auditShare;
}

void ShardCoordinator::start(const std::vector<Known>& shards, TimePoint now) {
    UMBRIEL_ASSERT(!_started && !bakeClass().empty(), "a bake starts once, when its class is known");
    _started = true;
    _shards.resize(shards.size());
    for (std::size_t i = 0; i < shards.size(); ++i) {
        _shards[i].done = shards[i].done;
        _shards[i].hash = shards[i].hash;
        _shards[i].auditWanted = isAudited(i) && (!shards[i].done || shards[i].hash);
        if (!shards[i].done) _open.insert(i);
    }
    advance(now);
}

std::string ShardCoordinator::nameOf(std::size_t server) const {
    const std::string& name = _servers[server].name;
    return name.empty() ? fmt::format("server {}", server + 1) : fmt::format("server '{}'", name);
}

bool ShardCoordinator::isCurrent(JobPeer peer) const {
    return peer.server < _servers.size() && _servers[peer.server].session == peer.session;
}

std::size_t ShardCoordinator::outstanding(std::size_t server) const {
    return static_cast<std::size_t>(
        std::ranges::count_if(_attempts, [&](const Attempt& attempt) { return attempt.server == server; }));
}

std::size_t ShardCoordinator::attemptsOf(std::size_t shard) const {
    return static_cast<std::size_t>(std::ranges::count_if(
        _attempts, [&](const Attempt& attempt) { return attempt.shard == shard && !attempt.audit; }));
}

ShardCoordinator::Attempts::iterator ShardCoordinator::find(std::size_t shard, std::uint32_t number) {
    return std::ranges::find_if(
        _attempts, [&](const Attempt& attempt) { return attempt.shard == shard && attempt.number == number; });
}

float ShardCoordinator::progressOf(std::size_t shard) const {
    if (_shards[shard].done) return 1.0f;
    float progress = 0.0f;
    for (const Attempt& attempt : _attempts)
        if (attempt.shard == shard) progress = std::max(progress, attempt.progress);
    return progress;
}

// Servers

void ShardCoordinator::sessionBegun(JobPeer peer, const std::string& name, TimePoint now) {
    Server& server = _servers[peer.server];
    server.session = peer.session;
    server.name = name;
    server.lastSign = now;
    if (server.benched) return;
    server.state = Server::State::Preparing;
    server.prepareDeadline.reset();
    server.readiness.reset();
    Order order;
    order.peer = peer;
    order.job = kPrepareJob;
    order.attempt = ++server.prepareAttempt;
    order.lease = _options.prepareLease;
    _orders.push_back(std::move(order));
}

void ShardCoordinator::sessionEnded(JobPeer peer, const std::string& reason, TimePoint now) {
    if (!isCurrent(peer)) return;
    Server& server = _servers[peer.server];
    std::size_t lost = 0;
    for (auto attempt = _attempts.begin(); attempt != _attempts.end();) {
        if (attempt->server != peer.server) {
            ++attempt;
            continue;
        }
        const std::size_t index = static_cast<std::size_t>(attempt - _attempts.begin());
        const std::size_t shard = attempt->shard;
        lost += !attempt->audit;
        if (attempt->leased && ++_shards[shard].losses >= kMostLosses && !_shards[shard].quarantined) {
            _shards[shard].quarantined = true;
            _lastQuarantine = fmt::format("shard {} has ended {} sessions, the last with {}", shard, kMostLosses,
                                          nameOf(peer.server));
        }
        giveBack(attempt, true);
        attempt = _attempts.begin() + static_cast<std::ptrdiff_t>(index);
    }
    const bool wasPreparing = server.state == Server::State::Preparing;
    server.state = Server::State::Away;
    _notices.push_back(lost > 0 ? fmt::format("{} is lost ({}): {} of its shards are given out again",
                                              nameOf(peer.server), reason, lost)
                                : fmt::format("{} is lost ({})", nameOf(peer.server), reason));
    if (wasPreparing) strike(peer.server, "it is lost whenever it takes the mesh");
    advance(now);
}

void ShardCoordinator::ready(JobPeer peer, const std::string& bakeClass, std::uint32_t slots, TimePoint now) {
    if (!isCurrent(peer)) return;
    Server& server = _servers[peer.server];
    server.state = Server::State::Ready;
    server.bakeClass = bakeClass;
    server.slots = std::max(1u, slots);
    _lastProgress = now;
    if (!_firstReady) _firstReady = now;
    if (!_options.bakeClass.empty()) isUsableClass(peer.server);
    advance(now);
}

void ShardCoordinator::refused(JobPeer peer, const std::string& reason) {
    if (!isCurrent(peer)) return;
    Server& server = _servers[peer.server];
    server.state = Server::State::Refused;
    server.why = reason;
    _notices.push_back(fmt::format("{} takes no part: {}", nameOf(peer.server), reason));
}

bool ShardCoordinator::isUsableClass(std::size_t index) {
    const Server& server = _servers[index];
    if (server.bakeClass == _options.bakeClass) {
        _participants.insert(index);
        return true;
    }
    refused(peerOf(index), fmt::format("it bakes in class \"{}\", this bake's is \"{}\", and files of two classes may "
                                       "differ in last bits",
                                       server.bakeClass, _options.bakeClass));
    return false;
}

void ShardCoordinator::decideClass(TimePoint now) {
    if (!_options.bakeClass.empty() || !_firstReady) return;
    const bool wait = std::ranges::any_of(
        _servers, [](const Server& server) { return server.state == Server::State::Preparing && !server.benched; });
    if (wait && now < *_firstReady + _options.classPatience) return;
    const auto first = std::ranges::find_if(_servers, [](const Server& server) { return server.usable(); });
    if (first == _servers.end()) return;
    _options.bakeClass = first->bakeClass;
    for (std::size_t i = 0; i < _servers.size(); ++i)
        if (_servers[i].usable()) isUsableClass(i);
}

void ShardCoordinator::strike(std::size_t index, const std::string& reason) {
    Server& server = _servers[index];
    if (++server.strikes < kMostStrikes || server.benched) return;
    server.benched = true;
    server.why = reason;
    _notices.push_back(
        fmt::format("{} gets no more work after {} failures in a row: {}", nameOf(index), server.strikes, reason));
    for (std::size_t i = _attempts.size(); i-- > 0;) {
        if (_attempts[i].server != index) continue;
        cancel(_attempts[i]);
        giveBack(_attempts.begin() + static_cast<std::ptrdiff_t>(i), true);
    }
}

// Shards

void ShardCoordinator::leased(JobPeer peer, const wire::JobLease& lease, TimePoint now) {
    if (!isCurrent(peer)) return;
    Server& server = _servers[peer.server];
    server.lastSign = now;
    if (lease.job == kPrepareJob) {
        if (server.state == Server::State::Preparing) server.prepareDeadline = now + _options.prepareLease;
        return;
    }
    const auto attempt = lease.job <= _shards.size() ? find(lease.job - 1, lease.attempt) : _attempts.end();
    if (attempt == _attempts.end() || attempt->server != peer.server) return;  // it will hear of its end
    if (!attempt->leased) attempt->since = now;
    attempt->leased = true;
    attempt->progress = std::clamp(lease.progress, 0.0f, 1.0f);
    attempt->deadline = now + _options.lease;
}

void ShardCoordinator::jobDone(JobPeer peer, const wire::JobDone& done, TimePoint now) {
    if (!isCurrent(peer)) return;
    Server& server = _servers[peer.server];
    server.lastSign = now;
    if (done.job == kPrepareJob) {
        if (done.attempt != server.prepareAttempt || server.state != Server::State::Preparing) return;
        if (done.status != JobStatus::Done || done.resultBytes == 0)
            return refused(peer, done.text.empty() ? "it does not get ready" : done.text);
        server.readiness = done.result;
        Order order;
        order.kind = Order::Kind::Fetch;
        order.peer = peer;
        order.result = {done.result, 1, done.resultBytes};
        _orders.push_back(std::move(order));
        return;
    }
    if (!_started || done.job > _shards.size()) return strike(peer.server, "it ends jobs that nobody gave to it");
    const std::size_t shard = done.job - 1;
    const auto attempt = find(shard, done.attempt);
    const bool known = attempt != _attempts.end() && attempt->server == peer.server;
    switch (done.status) {
        case JobStatus::Done:
            if (done.resultBytes > 0) {
                resultOf(peer, shard, done, now);
            } else if (known) {
                giveBack(attempt, true);
                shardFailed(shard, peer.server, "it sends nothing for a shard");
            }
            break;
        case JobStatus::Failed:
            if (known) {
                giveBack(attempt, true);
                shardFailed(shard, peer.server, done.text);
            }
            break;
        case JobStatus::Refused:
            if (known) {
                giveBack(attempt, false);
                strike(peer.server, done.text);
            }
            break;
        case JobStatus::Cancelled:
            if (known) giveBack(attempt, true);  // not by us
            break;
    }
    advance(now);
}

// Also of an attempt that was given up: a late result is as good as any.
void ShardCoordinator::resultOf(JobPeer peer, std::size_t number, const wire::JobDone& done, TimePoint now) {
    Shard& shard = _shards[number];
    auto attempt = find(number, done.attempt);
    if (attempt == _attempts.end() || attempt->server != peer.server) {
        Attempt late;
        late.shard = number;
        late.number = done.attempt;
        late.server = peer.server;
        late.since = now;
        _attempts.push_back(late);
        attempt = _attempts.end() - 1;
        _open.erase(number);
    } else if (attempt->leased) {
        if (_durations.size() < kDurations) _durations.resize(_durations.size() + 1);
        _durations[_durationCount++ % kDurations] = now - attempt->since;
    }
    attempt->leased = false;  // the lease has been kept
    // The same is known already, recorded or on its way. What differs is fetched: it may be garbage, or that may be.
    const bool known = shard.done
                           ? !shard.hash || *shard.hash == done.result
                           : std::ranges::any_of(_attempts, [&](const Attempt& one) {
                                 return one.shard == number && one.result.bytes > 0 && one.result.hash == done.result;
                             });
    if (known) {
        if (shard.done) _servers[peer.server].strikes = 0;
        if (shard.done && attempt->audit && shard.by != peer.server) {
            ++_audited;
            shard.auditWanted = false;
        }
        cancel(*attempt);  // lets go of the result
        return giveBack(attempt, false);
    }
    attempt->result = {done.result, 1, done.resultBytes};
    fetchNext();
}

void ShardCoordinator::fetchNext() {
    auto fetching = std::ranges::count_if(_attempts, [](const Attempt& attempt) { return attempt.fetching; });
    for (Attempt& attempt : _attempts) {
        if (fetching >= kFetches) return;
        if (attempt.result.bytes == 0 || attempt.fetching) continue;
        attempt.fetching = true;
        ++fetching;
        Order order;
        order.kind = Order::Kind::Fetch;
        order.peer = peerOf(attempt.server);
        order.result = attempt.result;
        _orders.push_back(std::move(order));
    }
}

std::optional<std::uint64_t> ShardCoordinator::fetched(JobPeer peer, const Hash128& result) {
    if (!isCurrent(peer)) return {};
    Server& server = _servers[peer.server];
    if (server.readiness == result) {
        server.readiness.reset();
        return kPrepareJob;
    }
    for (const Attempt& attempt : _attempts)
        if (attempt.server == peer.server && attempt.fetching && attempt.result.hash == result)
            return jobOf(attempt.shard);
    return {};
}

void ShardCoordinator::stored(JobPeer peer, std::size_t number, TimePoint now) {
    Shard& shard = _shards[number];
    const auto taken = fetching(peer, number);
    shard.hash = taken->result.hash;
    shard.by = peer.server;
    shard.done = true;
    _lastProgress = now;
    _servers[peer.server].strikes = 0;
    _attempts.erase(taken);
    _open.erase(number);
    for (std::size_t i = _attempts.size(); i-- > 0;) {
        const Attempt& other = _attempts[i];
        // What differs is looked at.
        if (other.shard != number || (other.result.bytes > 0 && other.result.hash != *shard.hash)) continue;
        cancel(other);
        _attempts.erase(_attempts.begin() + static_cast<std::ptrdiff_t>(i));
    }
    fetchNext();
    advance(now);
}

void ShardCoordinator::dissented(JobPeer peer, std::size_t number) {
    const auto& by = _shards[number].by;
    _disputed = number;
    fail(
        fmt::format("shard {} differs between {} and {}: one of them computes wrongly, and nothing it has made may be "
                    "trusted",
                    number, by ? nameOf(*by) : "an earlier run", nameOf(peer.server)));
}

ShardCoordinator::Attempts::iterator ShardCoordinator::fetching(JobPeer peer, std::size_t number) {
    const auto attempt = std::ranges::find_if(_attempts, [&](const Attempt& one) {
        return one.shard == number && one.server == peer.server && one.fetching;
    });
    UMBRIEL_ASSERT(attempt != _attempts.end(), "an answer to what was fetched");
    return attempt;
}

void ShardCoordinator::spoilt(JobPeer peer, std::size_t number, const std::string& reason) {
    giveBack(fetching(peer, number), true);
    shardFailed(number, peer.server, reason);
    fetchNext();
}

void ShardCoordinator::cancel(const Attempt& attempt) {
    Order order;
    order.kind = Order::Kind::Cancel;
    order.peer = peerOf(attempt.server);
    order.job = jobOf(attempt.shard);
    order.attempt = attempt.number;
    _orders.push_back(std::move(order));
}

void ShardCoordinator::cancelAll() {
    for (const Attempt& attempt : _attempts) cancel(attempt);
    _attempts.clear();
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        if (_servers[i].state != Server::State::Preparing) continue;
        Order order;
        order.kind = Order::Kind::Cancel;
        order.peer = peerOf(i);
        order.job = kPrepareJob;
        order.attempt = _servers[i].prepareAttempt;
        _orders.push_back(std::move(order));
    }
}

void ShardCoordinator::giveBack(Attempts::iterator attempt, bool counts) {
    const Attempt gone = *attempt;
    _attempts.erase(attempt);
    const Shard& shard = _shards[gone.shard];
    if (gone.audit || shard.done || shard.quarantined || attemptsOf(gone.shard) > 0) return;
    _open.insert(gone.shard);
    _redone += counts;
}

void ShardCoordinator::shardFailed(std::size_t number, std::size_t server, const std::string& reason) {
    Shard& shard = _shards[number];
    ++shard.failures;
    shard.failedOn.insert(server);
    _notices.push_back(fmt::format("{} fails with shard {}: {}", nameOf(server), number, reason));
    strike(server, reason);
    // Only servers that otherwise work may condemn it, and all of them must.
    const bool believed = std::ranges::any_of(shard.failedOn, [&](std::size_t one) { return _servers[one].usable(); });
    if (shard.done || shard.failures < kMostFailures || !believed || hasUsableBeside(shard.failedOn)) return;
    shard.quarantined = true;
    _open.erase(number);
    _lastQuarantine =
        fmt::format("shard {} has failed {} times, the last on {}: {}", number, shard.failures, nameOf(server), reason);
}

// Time

void ShardCoordinator::advance(TimePoint now) {
    _now = now;
    if (isFinished()) return;
    for (std::size_t i = _attempts.size(); i-- > 0;) {
        if (i >= _attempts.size()) continue;  // a strike has taken several
        const Attempt& attempt = _attempts[i];
        if (attempt.result.bytes > 0) continue;  // it has only to be fetched
        const bool leaseOver = attempt.leased && now >= attempt.deadline;
        // Jobs wait behind others without a lease, but a server that lives shows it.
        const bool silent = !attempt.leased && now >= _servers[attempt.server].lastSign + 2 * _options.lease &&
                            now >= attempt.since + 2 * _options.lease;
        if (!leaseOver && !silent) continue;
        const std::size_t server = attempt.server;
        _notices.push_back(fmt::format("{} shows no sign of life with shard {}: it is given out again", nameOf(server),
                                       attempt.shard));
        cancel(attempt);
        _shards[attempt.shard].failedOn.insert(server);
        giveBack(_attempts.begin() + static_cast<std::ptrdiff_t>(i), true);
        strike(server, "its leases end");
    }
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        Server& server = _servers[i];
        if (server.state == Server::State::Preparing && server.prepareDeadline && now >= *server.prepareDeadline)
            refused(peerOf(i), "it does not get ready");
    }
    decideClass(now);
    if (_started) {
        giveOut(now);
        settle(now);
    }
    if (!isFinished()) checkServers(now);
    if (!isFinished()) remind(now);
}

void ShardCoordinator::checkServers(TimePoint now) {
    bool anyUsable = false, anyHope = false;
    std::string reasons;
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        const Server& server = _servers[i];
        const bool preparing = server.state == Server::State::Preparing && !server.benched;
        anyUsable = anyUsable || server.usable() || preparing;
        anyHope = anyHope || (server.state == Server::State::Away && !server.benched);
        if (!server.why.empty()) reasons += fmt::format("; {}: {}", nameOf(i), server.why);
    }
    if (anyUsable) {
        _lastUsable = now;
    } else if (!anyHope) {
        fail("none of the servers can take part" + reasons);
    } else if (now >= _lastUsable + _options.patience) {
        fail(fmt::format("no server that bakes has been there for {:.0f} s{}", toSeconds(_options.patience), reasons));
    }
}

void ShardCoordinator::remind(TimePoint now) {
    if (now < _lastProgress + _options.reminder) return;
    _lastProgress = now;
    std::string who;
    for (std::size_t i = 0; i < _servers.size(); ++i) {
        const Server& server = _servers[i];
        const std::size_t has = outstanding(i);
        if (!who.empty()) who += ", ";
        who += nameOf(i);
        if (server.benched || server.state == Server::State::Refused)
            who += " takes no part";
        else if (server.state == Server::State::Away)
            who += " is not there";
        else if (server.state == Server::State::Preparing)
            who += " is getting ready";
        else
            who += fmt::format(" has {} shards", has);
    }
    _notices.push_back(fmt::format("nothing was finished for {:.0f} s: {}", toSeconds(_options.reminder), who));
}

TimePoint ShardCoordinator::deadline() const {
    if (isFinished()) return TimePoint::max();
    TimePoint earliest = std::min(_lastUsable + _options.patience, _lastProgress + _options.reminder);
    if (bakeClass().empty() && _firstReady) earliest = std::min(earliest, *_firstReady + _options.classPatience);
    for (const Attempt& attempt : _attempts)
        if (attempt.leased) earliest = std::min(earliest, attempt.deadline);
    // An idle server takes over what is slow elsewhere; silent ones are noticed in steps as well.
    if (!_attempts.empty()) earliest = std::min(earliest, _now + kIdleTick);
    return std::max(earliest, _now + std::chrono::milliseconds(1));
}

std::optional<ShardCoordinator::Order> ShardCoordinator::nextOrder() {
    if (_orders.empty()) return std::nullopt;
    Order order = std::move(_orders.front());
    _orders.pop_front();
    return order;
}

void ShardCoordinator::giveOut(TimePoint now) {
    // Those with the least to do first, in the order of the list: small bakes reach all servers.
    const auto giveOne = [&] {
        std::vector<std::pair<double, std::size_t>> room;
        for (std::size_t i = 0; i < _servers.size(); ++i) {
            const std::size_t has = outstanding(i);
            if (_servers[i].usable() && has < windowOf(_servers[i]))
                room.emplace_back(static_cast<double>(has) / _servers[i].slots, i);
        }
        std::ranges::sort(room);
        return std::ranges::any_of(room, [&](const auto& one) { return giveTo(one.second, now); });
    };
    while (!_open.empty() && giveOne()) continue;
    if (!_open.empty()) return;
    for (std::size_t i = 0; i < _servers.size(); ++i)
        if (_servers[i].usable() && outstanding(i) < _servers[i].slots) takeOver(i, now);
}

bool ShardCoordinator::giveTo(std::size_t server, TimePoint now) {
    // One that has failed here goes elsewhere, if there is an elsewhere.
    const auto next = std::ranges::find_if(_open, [&](std::size_t shard) {
        const auto& failedOn = _shards[shard].failedOn;
        return !failedOn.contains(server) || !hasUsableBeside(failedOn);
    });
    if (next == _open.end()) return false;
    bake(server, *next, false, now);
    return true;
}

bool ShardCoordinator::hasUsableBeside(const std::set<std::size_t>& servers) const {
    for (std::size_t i = 0; i < _servers.size(); ++i)
        if (_servers[i].usable() && !servers.contains(i)) return true;
    return false;
}

void ShardCoordinator::bake(std::size_t server, std::size_t number, bool audit, TimePoint now) {
    Attempt attempt;
    attempt.shard = number;
    attempt.number = ++_shards[number].attempts;
    attempt.server = server;
    attempt.audit = audit;
    attempt.since = now;
    _attempts.push_back(attempt);
    if (!audit) _open.erase(number);
    Order order;
    order.kind = Order::Kind::Bake;
    order.peer = peerOf(server);
    order.job = jobOf(number);
    order.attempt = attempt.number;
    order.shard = number;
    order.audit = audit;
    order.lease = _options.lease;
    _orders.push_back(std::move(order));
}

// Work for a server that would idle: an audit, what waits behind other work elsewhere, what takes very long elsewhere.
bool ShardCoordinator::takeOver(std::size_t server, TimePoint now) {
    for (std::size_t i = 0; i < _shards.size(); ++i) {
        const Shard& shard = _shards[i];
        if (!shard.auditWanted || !shard.done || shard.by == server || shard.failedOn.contains(server)) continue;
        if (std::ranges::any_of(_attempts, [&](const Attempt& one) { return one.shard == i; })) continue;
        bake(server, i, true, now);
        return true;
    }
    if (outstanding(server) > 0) return false;
    const auto waits = std::ranges::find_if(_attempts, [&](const Attempt& one) {
        return !one.leased && !one.audit && one.result.bytes == 0 &&
               outstanding(one.server) > _servers[one.server].slots;
    });
    if (waits != _attempts.end()) {
        const std::size_t shard = waits->shard;
        cancel(*waits);
        giveBack(waits, false);
        bake(server, shard, false, now);
        return true;
    }
    if (_durations.empty()) return false;
    auto sorted = _durations;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const Duration slow = std::max(kSlowLeast, kSlowFactor * *middle);
    const auto late = std::ranges::find_if(_attempts, [&](const Attempt& one) {
        return one.leased && !one.audit && one.server != server && now >= one.since + slow &&
               attemptsOf(one.shard) == 1;
    });
    if (late == _attempts.end()) return false;
    bake(server, late->shard, false, now);
    return true;
}

void ShardCoordinator::settle(TimePoint) {
    const bool settled = std::ranges::all_of(_shards, [](const Shard& one) { return one.done || one.quarantined; });
    if (!settled) return;
    for (std::size_t i = 0; i < _shards.size(); ++i) {
        Shard& shard = _shards[i];
        if (!shard.auditWanted || !shard.done) continue;
        const bool possible = std::ranges::any_of(_servers, [&](const Server& one) {
            const auto index = static_cast<std::size_t>(&one - _servers.data());
            return shard.by != index && !shard.failedOn.contains(index) && !one.benched &&
                   (one.usable() || one.state == Server::State::Preparing);
        });
        if (possible) return;
        shard.auditWanted = false;
        _notices.push_back(fmt::format("shard {} is not audited: no other server is there", i));
    }
    // What is on its way may differ.
    if (std::ranges::any_of(_attempts, [](const Attempt& one) { return one.result.bytes > 0; })) return;
    cancelAll();
    _finished = true;
    if (!_lastQuarantine.empty()) fail(_lastQuarantine);
}

void ShardCoordinator::fail(std::string message) {
    if (!_error) _error = failure(std::move(message));
}

}  // namespace umbriel
