#include "tests/sim/simulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <vector>

#include "common/net/memory_pump.h"
#include "common/protocol/cluster_client.h"
#include "common/scene/core_types.h"
#include "common/scene/materials.h"
#include "common/scene/nodes.h"
#include "common/wire/view_codec.h"
#include "tests/sim/swarm.h"

namespace umbriel::sim {

using namespace std::chrono_literals;
using protocol::FailurePolicy;
using protocol::FramePacing;

namespace {

constexpr std::uint16_t kPort = 7420;
constexpr int kTile = 16;  // pixels
// After a fault a server may take this long to be as if nothing had happened: 2 s and what was under way.
constexpr Duration kRecovery = 3s;
// What a frame takes beyond drawing: the network's ways, and a blob's.
constexpr Duration kFrameSlack = 150ms;
constexpr Duration kHealLimit = 2s;

class Simulation final : public ModelServer::Observer {
 public:
    Simulation(std::uint64_t seed, Planted planted)
        : _random(seed),
          _swarm(_random),
          _planted(planted),
          _network({_random.next(), _swarm.leastLatency, _swarm.mostLatency, _swarm.split, _swarm.window}),
          _scene(_types, _ids) {
        registerCoreTypes(_types);
    }

    Outcome run() {
        _outcome.swarm = _swarm.text();
        start();
        if (!failed()) safety();
        if (!failed() && !_over) liveness();
        _outcome.virtualSeconds = toSeconds(_network.now() - TimePoint{});
        return std::move(_outcome);
    }

    void shows(std::size_t server, std::uint64_t frame, std::optional<std::uint64_t> digest) override {
        mix(1);
        mix(server);
        mix(frame);
        mix(static_cast<std::uint64_t>((_network.now() - TimePoint{}).count()));
        const std::string who = fmt::format("server {} shows frame {}", server, frame);
        if (!digest) return fail(who + " before it has drawn it");
        mix(*digest);
        if (frame > _digests.size() || *digest != _digests[frame - 1])
            return fail(who + " from another state than the client's");
        Host& host = _hosts[server];
        // Whoever has been well for a while is waited for, unless the frame's deadline has passed.
        if (_network.now() - _begun[frame - 1] < FramePacing::kDegradeLeast)
            for (std::size_t i = 0; i < _hosts.size(); ++i)
                if (isWell(_hosts[i]) && !_hosts[i].server->hasDrawn(frame))
                    return fail(fmt::format("{} before server {} has drawn it", who, i));
        if (frame <= host.lastShown) return fail(fmt::format("{} after frame {}", who, host.lastShown));
        host.lastShown = frame;
        if (frame < _client->newestFinished) hit(Probe::ShownLate);
    }
    void hit(Probe probe) override { _outcome.probes.hit(probe); }

 private:
    enum class Fault { None, Paused, Silent, Dead, Slow };
    struct Host {
        std::string name;
        std::unique_ptr<ModelServer> server;
        Fault fault = Fault::None;
        TimePoint until;                           // of the fault
        TimePoint healthyFrom = TimePoint::min();  // when it must be as if nothing had happened
        std::uint64_t lastShown = 0;
        int rejoined = 0;
    };
    struct Client {
        explicit Client(protocol::ClusterClientOptions options, TimePoint now) : protocol(std::move(options), now) {}
        protocol::ClusterClient protocol;
        std::uint64_t newestFinished = 0;
    };

    bool isWell(const Host& host) const { return host.fault == Fault::None && _frameBegun >= host.healthyFrom; }
    bool failed() const { return !_outcome.failure.empty(); }
    void fail(std::string what) {
        if (!failed()) _outcome.failure = fmt::format("at {:.6f} s: {}", toSeconds(_network.now() - TimePoint{}), what);
    }
    void mix(std::uint64_t value) { _outcome.trace = (_outcome.trace ^ value) * 0x100000001b3; }

    void start() {
        protocol::ClusterClientOptions options;
        options.identity.name = "desk";
        options.identity.build = "sim";
        options.identity.typeSignature = _types.signature();
        options.token = {_random.next(), _random.next()};
        options.policy = _swarm.policy;
        if (_planted == Planted::DeadlineIgnored && _swarm.policy == FailurePolicy::Degrade)
            options.policy = FailurePolicy::Strict;
        options.latency = _swarm.latency;
        options.startIncomplete = _swarm.startIncomplete;
        options.historyBytes = _swarm.historyBytes;
        options.historyFrames = _swarm.historyFrames;
        if (_planted == Planted::NoRedial) options.rejoinLeast = options.rejoinMost = 5s;
        options.wall = {_swarm.servers * kTile, kTile};
        _hosts.resize(static_cast<std::size_t>(_swarm.servers));
        for (std::size_t i = 0; i < _hosts.size(); ++i) {
            _hosts[i].name = fmt::format("s{}", i);
            options.servers.push_back(
                {_hosts[i].name,
                 _hosts[i].name,
                 kPort,
                 {{static_cast<std::uint32_t>(i), {static_cast<int>(i) * kTile, 0, kTile, kTile}, Eye::Mono}}});
            if (_swarm.startIncomplete && i > 0 && _random.chance(50)) {
                _hosts[i].fault = Fault::Dead;
                _hosts[i].until = _network.now() + randomDuration<std::chrono::milliseconds>(_random, 5500, 7000);
                hit(Probe::StartedIncomplete);
                _missingAtStart = true;
            } else {
                bringUp(i);
            }
        }
        _client = std::make_unique<Client>(std::move(options), _network.now());
        _network.add(_client->protocol, [this] { watch(); });
        for (int i = 0; i < 12; ++i) edit();
        if (!_network.runUntil([this] { return !_client->protocol.isBusy(); }, 6s))
            return fail("the wall does not start");
        if (_client->protocol.error()) return fail("the wall does not start: " + _client->protocol.error()->message);
    }

    void bringUp(std::size_t index) {
        Host& host = _hosts[index];
        // Old programs stay in memory: the network knows endpoints by their address.
        if (host.server) _gone.push_back(std::move(host.server));
        host.server = std::make_unique<ModelServer>(index, host.name, _types, *this, _planted, _random.next(),
                                                    _swarm.leastDraw, _swarm.mostDraw, _network.now());
        host.lastShown = 0;
        _network.add(*host.server);
        _network.listen(*host.server, host.name, kPort);
    }

    // After everything that the client is told.
    void watch() {
        using Kind = protocol::ServerIncident::Kind;
        for (const auto& incident : _client->protocol.takeIncidents()) {
            mix(2 + static_cast<std::uint64_t>(incident.kind));
            mix(incident.server);
            switch (incident.kind) {
                case Kind::Late:
                    hit(Probe::Late);
                    break;
                case Kind::Lost:
                    hit(Probe::Lost);
                    break;
                case Kind::Rejoined:
                    hit(Probe::Rejoined);
                    if (++_hosts[incident.server].rejoined == 2) hit(Probe::ReconnectedTwice);
                    break;
                case Kind::Refused:
                    hit(incident.text.find("no answer") != std::string::npos ? Probe::NoAnswer : Probe::Refused);
                    break;
                case Kind::Differing:
                case Kind::Compared:
                    fail(incident.text);
                    break;
            }
        }
        for (const auto& finished : _client->protocol.takeFinished()) {
            _client->newestFinished = finished.number;
            mix(finished.number);
            if (finished.mismatch)
                fail(fmt::format("frame {}: the state of server {} differs", finished.number, *finished.mismatch));
            bool anybody = false;
            for (const auto& server : finished.servers) {
                anybody = anybody || server.connected;
                if (_swarm.pixels && server.shown && server.tiles.empty()) hit(Probe::PixelsMissing);
            }
            if (!anybody) hit(Probe::NobodyThere);
        }
        const std::size_t queued = _network.queued(_client->protocol);
        if (queued > 0 && _swarm.window > 0) hit(Probe::Backpressure);
        _outcome.mostQueuedBytes = std::max<std::uint64_t>(_outcome.mostQueuedBytes, queued);
        // A MiB of change lists and one of blobs and what a heartbeat or a swap adds, for each server.
        if (queued > _hosts.size() * (std::size_t{5} << 19)) fail(fmt::format("{} bytes wait in queues", queued));
        // The last frame counts however large it is.
        if (_client->protocol.historyBytes() > _swarm.historyBytes + _largestFrame)
            fail(fmt::format("{} bytes of changes are kept", _client->protocol.historyBytes()));
    }

    void edit() {
        const auto pick = [&](const auto& all) {
            return all[static_cast<std::size_t>(_random.between(0, static_cast<std::int64_t>(all.size()) - 1))];
        };
        const std::int64_t what = _random.between(0, 99);
        if (_transforms.empty() || what < 10) {
            if (_transforms.size() < 40)
                _transforms.push_back(_scene.create<Transform>(fmt::format("t{}", _random.between(0, 999))));
        } else if (what < 15 && _transforms.size() > 4) {
            const auto at = _transforms.begin() + _random.between(0, static_cast<std::int64_t>(_transforms.size()) - 1);
            _scene.destroy(at->id);
            _transforms.erase(at);
        } else if (what < 18) {
            if (_geometries.size() < 3) _geometries.push_back(_scene.create<Geometry>());
        } else if (what < 21 && !_geometries.empty()) {
            // Large enough to travel as a blob, or in the change list.
            const auto count =
                static_cast<std::size_t>(_random.chance(50) ? _random.between(2800, 4000) : _random.between(1, 300));
            _scene.edit(pick(_geometries))
                .assign<&Geometry::positions>(
                    std::vector<glm::vec3>(count, glm::vec3(static_cast<float>(_random.between(0, 1 << 20)))));
        } else {
            _scene.edit(pick(_transforms))
                .set<&Transform::translation>(glm::dvec3(static_cast<double>(_random.between(0, 1 << 30))));
        }
    }

    static std::map<Hash128, MultiStorage> blobsOf(wire::EncodedChanges& encoded) {
        std::map<Hash128, MultiStorage> blobs;
        for (wire::Blob& blob : encoded.blobs) blobs.emplace(blob.ref.hash, std::move(blob.data));
        return blobs;
    }

    wire::EncodedChanges encode(const ChangeList& changes) {
        wire::EncodeOptions encoding;
        encoding.maxPartBytes = 16 * 1024;
        auto encoded = wire::encodeChanges(changes, _scene, encoding);
        std::uint64_t bytes = encoded.bytes();
        for (const wire::Blob& blob : encoded.blobs) bytes += blob.data.byteSize();
        _largestFrame = std::max(_largestFrame, bytes);
        return encoded;
    }

    void beginFrame() {
        for (std::int64_t i = _random.between(0, 4); i > 0; --i) edit();
        const bool first = _digests.empty();
        ChangeList changes = _scene.commit();
        _digest.update(changes, _scene);
        if (first) changes = _scene.snapshot();
        auto encoded = encode(changes);
        protocol::OutgoingFrame frame;
        frame.fromNothing = first;
        frame.number = _digests.size() + 1;
        frame.wantPixels = _swarm.pixels;
        frame.time = static_cast<double>(frame.number) / 60.0;
        frame.views = _views;
        frame.changes = std::move(encoded.parts);
        frame.blobs = blobsOf(encoded);
        if (_planted == Planted::ForgottenChange && !first && _random.chance(2)) frame.changes.clear();
        frame.digest = _digest.total();
        if (!first && _client->protocol.wantsSnapshot()) {
            hit(Probe::Snapshot);
            ChangeList whole = _scene.snapshot();
            if (_planted == Planted::IncompleteSnapshot && !whole.created.empty()) {
                const ContainerId lost = whole.created.back().id;
                std::erase_if(whole.created, [&](const auto& one) { return one.id == lost; });
                std::erase_if(whole.changed, [&](const auto& one) { return one.id == lost; });
            }
            auto snapshot = encode(whole);
            frame.snapshot.emplace();
            frame.snapshot->parts = std::move(snapshot.parts);
            frame.snapshot->blobs = blobsOf(snapshot);
        }
        _digests.push_back(frame.digest);
        _begun.push_back(_network.now());
        if (_client->newestFinished + 1 < frame.number) hit(Probe::OverlappedFrame);
        ++_outcome.frames;
        _frameBegun = _network.now();
        _waiting = true;
        _client->protocol.beginFrame(std::move(frame), _network.now());
        _network.poke(_client->protocol);
    }

    // The longest that the frame under way may keep the application, by what has happened lately.
    Duration waitLimit() const {
        std::size_t healthy = 0;
        for (const Host& host : _hosts) healthy += isWell(host);
        const Duration normal = kFrameSlack + 2 * _swarm.mostDraw;
        const int phases = _swarm.pixels ? 2 : 1;
        // A majority that is well starts the deadline; else the silence of the others must be noticed first, and some
        // of them may fall silent while that is done.
        const bool well = 2 * healthy >= _hosts.size();
        if (_swarm.policy == FailurePolicy::Wait) return normal + 5s;
        if (_swarm.policy == FailurePolicy::Strict || _digests.size() <= 2)
            return normal + phases * FramePacing::kStrictLimit + (well ? 0s : 4500ms);
        return normal + phases * FramePacing::kDegradeMost + (well ? 0s : 4500ms);
    }

    // Lets the clock run until the time, drawing frames.
    void runUntil(
        TimePoint end, const std::function<bool()>& enough = [] { return false; }) {
        while (!failed() && !_over && _network.now() < end && !enough()) {
            if (!_waiting && _network.now() >= _nextFrame) beginFrame();
            TimePoint next = end;
            if (!_waiting) next = std::min(next, _nextFrame);
            for (const Host& host : _hosts)
                if (host.fault != Fault::None) next = std::min(next, host.until);
            _network.runUntil([&] { return failed() || (_waiting && !_client->protocol.isBusy()) || enough(); },
                              std::max(Duration(0), next - _network.now()));
            if (_client->protocol.error()) return ended();
            if (_waiting) {
                const Duration waited = _network.now() - _frameBegun;
                _outcome.longestWaitSeconds = std::max(_outcome.longestWaitSeconds, toSeconds(waited));
                // The limit when it began counts: what happened since may have made it longer, never shorter.
                if (waited > std::max(_limit, waitLimit()))
                    fail(fmt::format("frame {} has waited for {:.3f} s", _digests.size(), toSeconds(waited)));
            }
            if (_waiting && !_client->protocol.isBusy()) {
                _waiting = false;
                _nextFrame = _network.now() + Duration(_random.between(0, 2 * _swarm.think.count()));
                _limit = Duration(0);
            } else if (_waiting) {
                _limit = std::max(_limit, waitLimit());
            }
            for (std::size_t i = 0; i < _hosts.size(); ++i)
                if (_hosts[i].fault != Fault::None && _network.now() >= _hosts[i].until) mend(i);
        }
    }

    // Under Wait, and only because of a fault that loses a server.
    void ended() {
        if (_swarm.policy != FailurePolicy::Wait || !_lethalHappened) return fail(_client->protocol.error()->message);
        hit(Probe::WaitEnded);
        _over = true;
    }

    void safety() {
        const TimePoint end = _network.now() + (_missingAtStart ? _swarm.safety + 2s : _swarm.safety);
        while (!failed() && !_over && _network.now() < end) {
            // Now and then a server that is just coming back is hit again.
            const bool again =
                !_hosts[_lastMended].server || _random.chance(75) ? false : isComingBack(_hosts[_lastMended]);
            const Duration pause = again ? randomDuration<std::chrono::microseconds>(_random, 0, 30'000)
                                         : Duration(_random.between(0, 2 * _swarm.betweenFaults.count()));
            runUntil(std::min(end, _network.now() + pause));
            if (!failed() && !_over)
                breakSomething(
                    again ? _lastMended
                          : static_cast<std::size_t>(_random.between(0, static_cast<std::int64_t>(_hosts.size()) - 1)));
        }
    }

    bool isComingBack(const Host& host) const { return host.fault == Fault::None && _network.now() < host.healthyFrom; }

    void breakSomething(std::size_t index) {
        Host& host = _hosts[index];
        if (host.fault != Fault::None) return;
        const bool wait = _swarm.policy == FailurePolicy::Wait;
        // Under Wait, what a live session survives: its last heartbeat may be a second old.
        const auto time = [&] { return randomDuration<std::chrono::milliseconds>(_random, 20, wait ? 800 : 4000); };
        const std::int64_t what = _random.between(0, 4);
        const bool lethal = !wait || _swarm.lethal;
        if (what == 0 && _swarm.pauses) {
            host.fault = Fault::Paused;
            host.until = _network.now() + time();
            _network.setPaused(*host.server, true);
        } else if (what == 1 && _swarm.silences) {
            host.fault = Fault::Silent;
            host.until = _network.now() + time();
            _network.setSilent(*host.server, true);
        } else if (what == 2 && _swarm.slow) {
            host.fault = Fault::Slow;
            host.until = _network.now() + time();
            host.server->setSlow(true);
        } else if (what == 3 && _swarm.resets && lethal) {
            _lethalHappened = true;
            if (_random.chance(40))
                _network.resetHalf(*host.server);
            else
                _network.reset(*host.server);
            host.healthyFrom = _network.now() + kRecovery;
        } else if (what == 4 && _swarm.restarts && lethal) {
            _lethalHappened = true;
            if (host.server->isDrawing()) hit(Probe::KilledDrawing);
            if (host.server->isJoining()) hit(Probe::KilledJoining);
            host.fault = Fault::Dead;
            host.until = _network.now() + randomDuration<std::chrono::milliseconds>(_random, 0, 3000);
            _network.remove(*host.server);
        } else {
            return;
        }
        ++_outcome.faults;
    }

    void mend(std::size_t index) {
        Host& host = _hosts[index];
        host.healthyFrom = _network.now() + kRecovery;
        _lastMended = index;
        switch (std::exchange(host.fault, Fault::None)) {
            case Fault::Paused:
                _network.setPaused(*host.server, false);
                break;
            case Fault::Silent:
                _network.setSilent(*host.server, false);
                break;
            case Fault::Slow:
                host.server->setSlow(false);
                break;
            case Fault::Dead:
                bringUp(index);
                break;
            case Fault::None:
                break;
        }
    }

    void liveness() {
        for (std::size_t i = 0; i < _hosts.size(); ++i)
            if (_hosts[i].fault != Fault::None) mend(i);
        const TimePoint healed = _network.now();
        const std::uint64_t since = _digests.size();
        const auto whole = [&] {
            if (!_client->protocol.isWhole()) return false;
            return std::all_of(_hosts.begin(), _hosts.end(), [&](const Host& host) { return host.lastShown > since; });
        };
        runUntil(healed + kHealLimit, whole);
        if (failed() || _over) return;
        if (!whole()) {
            std::string names;
            for (const Host& host : _hosts)
                if (host.lastShown <= since) names += " " + host.name;
            return fail(fmt::format("the wall is not whole 2 s after the last fault:{} {}", names,
                                    _client->protocol.isWhole() ? "" : "(the client knows)"));
        }
        _outcome.healSeconds = toSeconds(_network.now() - healed);
        // And it stays so.
        const std::uint64_t lost = _outcome.probes.counts[static_cast<std::size_t>(Probe::Lost)] +
                                   _outcome.probes.counts[static_cast<std::size_t>(Probe::Late)];
        runUntil(_network.now() + 300ms);
        if (failed() || _over) return;
        if (lost != _outcome.probes.counts[static_cast<std::size_t>(Probe::Lost)] +
                        _outcome.probes.counts[static_cast<std::size_t>(Probe::Late)])
            fail("the wall was whole and a server is lost or late again without a fault");
    }

    Random _random;
    Swarm _swarm;
    Planted _planted;
    net::MemoryNetwork _network;
    TypeRegistry _types;
    IdSource _ids;
    Aspect _scene;
    StateDigest _digest;
    wire::Bytes _views = wire::encodeViews(WallViews{});
    std::vector<Ref<Transform>> _transforms;
    std::vector<Ref<Geometry>> _geometries;
    std::vector<Host> _hosts;
    std::vector<std::unique_ptr<ModelServer>> _gone;
    std::unique_ptr<Client> _client;
    std::vector<std::uint64_t> _digests;  // the client's, by frame from 1
    std::vector<TimePoint> _begun;        // likewise
    std::uint64_t _largestFrame = 0;
    std::size_t _lastMended = 0;
    bool _waiting = false;
    bool _lethalHappened = false;
    bool _missingAtStart = false;
    bool _over = false;
    TimePoint _frameBegun;
    TimePoint _nextFrame;
    Duration _limit{0};
    Outcome _outcome;
};

}  // namespace

Outcome simulate(std::uint64_t seed, Planted planted) {
    return Simulation(seed, planted).run();
}

}  // namespace umbriel::sim
