#include "tests/sim/bake_world.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/protocol/server_node.h"
#include "common/visibility/bake_job.h"
#include "server/bake/job_queue.h"
#include "tests/unit/visibility/test_meshes.h"

namespace umbriel::sim {

using namespace std::chrono_literals;
using namespace visibility;

namespace {

constexpr std::uint16_t kPort = 7420;
constexpr Duration kStep = 5ms;

}  // namespace

BakeSubject::BakeSubject() : loaded(visibility::test::cloth(100, 80)), mesh(*prepare(loaded)) {
    settings.mapping = {MappingKind::HemiSphere, 8};
    baker = std::move(*Baker::create(mesh, settings));
    const std::uint64_t rows = mesh.rows.size();
    for (std::uint64_t first = 0; first < rows; first += kRowsPerBlock)
        shards.push_back(*baker->shard(first, std::min<std::uint64_t>(kRowsPerBlock, rows - first)));
    const Bytes bytes = *baker->shard(0, rows);
    whole.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

const BakeSubject& bakeSubject() {
    static const BakeSubject one;
    return one;
}

// A render server as far as jobs are concerned. Its work takes virtual time.
class BakeServer {
 public:
    BakeServer(const std::string& name, Manner manner, std::uint64_t seed, TimePoint now)
        : node(options(name), now), _manner(manner), _random(seed) {}

    protocol::ServerNode node;

    // Its program's turn: what came, what is done.
    void turn(TimePoint now) {
        namespace event = protocol::server_event;
        while (auto next = node.nextEvent()) {
            if (std::get_if<event::SessionStarted>(&*next)) {
                ++_session;
            } else if (std::get_if<event::SessionEnded>(&*next)) {
                _table.cancelAll();
                _table.takeEvents();
                _waiting.clear();
                _work.reset();
            } else if (auto* arrived = std::get_if<event::BlobArrived>(&*next)) {
                _blobs.put(std::move(arrived->blob));
            } else if (auto* job = std::get_if<event::JobOffered>(&*next)) {
                std::vector<wire::BlobRef> missing;
                for (const wire::BlobRef& ref : job->blobs)
                    if (!_blobs.find(ref.hash)) missing.push_back(ref);
                node.wantBlobs(missing);
                _waiting.push_back(std::move(*job));
            } else if (auto* cancelled = std::get_if<event::JobCancelled>(&*next)) {
                _table.cancel({cancelled->job, cancelled->attempt, _session});
            }
        }
        while (!_waiting.empty() && std::ranges::all_of(_waiting.front().blobs, [&](const wire::BlobRef& ref) {
            return _blobs.find(ref.hash) != nullptr;
        })) {
            auto& job = _waiting.front();
            _table.offer({{job.job, job.attempt, _session}, job.kind, job.payload, job.lease, {}}, true, now);
            _waiting.erase(_waiting.begin());
        }
        step(now);
        for (JobEvent& one : _table.takeEvents()) say(std::move(one));
    }

 private:
    struct Work {
        JobOffer offer;
        TimePoint until;
        bool stalls = false;
    };

    static protocol::ServerNodeOptions options(const std::string& name) {
        protocol::ServerNodeOptions options;
        options.identity.name = name;
        options.identity.build = "test";
        return options;
    }

    void step(TimePoint now) {
        _table.advance(now);
        if (_work) {
            if (!_work->stalls && !_table.alive(_work->offer.key, 0.5f, now)) _work.reset();
            if (_work && now >= _work->until) {
                _table.finish(_work->offer.key, resultOf(_work->offer));
                _work.reset();
            }
        }
        if (_work) return;
        if (auto offer = _table.start(now)) {
            const bool stalls = _manner == Manner::Stalling && offer->kind == kShardJob && _random.chance(30);
            _work = Work{std::move(*offer), now + std::chrono::milliseconds(_random.between(20, 800)), stalls};
            if (stalls) _work->until += 40s;
        }
    }

    Result<std::vector<std::byte>> resultOf(const JobOffer& offer) {
        const auto job = decodeBakeJob(offer.payload);
        if (!job) return job.error();
        const BakeSubject& s = bakeSubject();
        const MapHeader& header = s.baker->header();
        if (offer.kind == kPrepareJob)
            return encodeReadiness({_manner == Manner::OtherClass ? "another class" : header.bakeClass, 1,
                                    header.meshHash, header.directionHash});
        const std::size_t shard = job->firstRow / kRowsPerBlock;
        Bytes bytes = s.shards[shard];
        if (_manner == Manner::Failing) return failure("no memory");
        if (_manner == Manner::Garbage) {
            const auto kind = _random.between(0, 3);
            if (kind == 0) bytes.resize(bytes.size() / 2);
            if (kind == 1) bytes[static_cast<std::size_t>(_random.between(0, 200))] ^= std::byte{1};
            if (kind == 2) bytes.back() ^= std::byte{1};
            if (kind == 3) bytes = s.shards[(shard + 1) % s.shards.size()];
        }
        if (_manner == Manner::Liar) {
            // A sound file of this shard whose maps are wrong.
            const std::uint32_t rows = static_cast<std::uint32_t>(job->rowCount);
            Bytes raw(rows * bytesPerRow(MapContent::Mask, s.settings.mapping), std::byte{0x5a});
            MapHeader own = header;
            own.firstRow = job->firstRow;
            own.rowCount = job->rowCount;
            const std::vector blocks{encodeBlock(MapContent::Mask, rows, raw)};
            bytes = *assembleShard(own, s.mesh.vertexRow, blocks);
        }
        return bytes;
    }

    void say(JobEvent event) {
        if (event.key.session != _session) return;
        const auto [job, attempt, session] = event.key;
        using Kind = JobEvent::Kind;
        if (event.kind == Kind::Lease) return node.sendJobLease({job, attempt, event.progress});
        const auto status = event.kind == Kind::Done        ? wire::JobStatus::Done
                            : event.kind == Kind::Failed    ? wire::JobStatus::Failed
                            : event.kind == Kind::Cancelled ? wire::JobStatus::Cancelled
                                                            : wire::JobStatus::Refused;
        node.sendJobDone({job, attempt, status, event.text, {}, 0, 1000}, std::move(event.result));
    }

    Manner _manner;
    Random _random;
    JobTable _table{256};
    std::uint64_t _session = 0;
    std::vector<protocol::server_event::JobOffered> _waiting;
    wire::BlobStore _blobs;
    std::optional<Work> _work;
};

namespace {

class BakeClock final : public Clock {
 public:
    explicit BakeClock(BakeWorld& world) : _world(world) {}
    TimePoint now() const override { return _world.now(); }

 private:
    BakeWorld& _world;
};

}  // namespace

class BakeWorld::Port final : public protocol::JobPort {
 public:
    Port(BakeWorld& world, protocol::ClusterClient& client, TimePoint end)
        : _world(world), _client(client), _end(end) {}
    std::size_t mostInFlight = 0;

    std::size_t serverCount() const override { return _client.serverCount(); }
    std::uint32_t provide(std::vector<wire::Blob> blobs) override {
        const std::uint32_t series = _client.provideBlobs(std::move(blobs));
        _world._network.poke(_client);
        return series;
    }
    void finish() override {
        _client.finishJobs();
        _world._network.poke(_client);
    }
    void offer(protocol::JobPeer peer, protocol::JobRequest request) override {
        if (request.kind == kShardJob) mostInFlight = std::max(mostInFlight, ++_inFlight);
        _client.offerJob(peer, request);
        _world._network.poke(_client);
    }
    void cancel(protocol::JobPeer peer, std::uint64_t job, std::uint32_t attempt) override {
        _client.cancelJob(peer, job, attempt);
        _world._network.poke(_client);
    }
    void fetch(protocol::JobPeer peer, const wire::BlobRef& result) override {
        _client.fetchResult(peer, result);
        _world._network.poke(_client);
    }
    Result<std::vector<protocol::JobNews>> wait(Duration most) override {
        const TimePoint until = _world.now() + most;
        do {
            if (_world.now() >= _end) return failure("the client was killed");
            if (_client.error()) return *_client.error();
            _world.step();
        } while (!_client.hasJobNews() && _world.now() < until);
        auto news = _client.takeJobNews();
        for (const auto& one : news) _inFlight -= one.kind == protocol::JobNews::Kind::Done && _inFlight > 0;
        return news;
    }

 private:
    BakeWorld& _world;
    protocol::ClusterClient& _client;
    TimePoint _end;
    std::size_t _inFlight = 0;
};

BakeWorld::BakeWorld(std::uint64_t seed, std::vector<Manner> manners)
    : _random(seed), _network({_random.next(), 100us, 3ms, _random.chance(30), 0}), _manners(std::move(manners)) {
    for (std::size_t i = 0; i < _manners.size(); ++i) {
        _hosts.emplace_back();
        start(i);
    }
}

BakeWorld::~BakeWorld() = default;

std::vector<Result<ClusterBakeOutcome>> BakeWorld::bakeInTurn(const std::vector<ClusterBakeOptions>& bakes,
                                                              const std::vector<Duration>& lives) {
    protocol::ClusterClientOptions client;
    client.identity.name = "client";
    client.identity.build = "test";
    client.token = {_random.next(), _random.next()};
    client.policy = protocol::FailurePolicy::Degrade;
    client.startIncomplete = true;
    for (std::size_t i = 0; i < _hosts.size(); ++i)
        client.servers.push_back({"", "host" + std::to_string(i), kPort, {}});
    _clients.push_back(std::make_unique<protocol::ClusterClient>(std::move(client), now()));
    protocol::ClusterClient& endpoint = *_clients.back();
    _network.add(endpoint);
    BakeClock clock(*this);
    std::vector<Result<ClusterBakeOutcome>> outcomes;
    for (std::size_t i = 0; i < bakes.size(); ++i) {
        const Duration life = i < lives.size() ? lives[i] : clientDiesAfter.value_or(1h);
        Port port(*this, endpoint, now() + life);
        outcomes.push_back(
            bakeOnCluster(bakeSubject().loaded, bakeSubject().mesh, bakeSubject().settings, bakes[i], port, clock));
        mostInFlight = std::max(mostInFlight, port.mostInFlight);
    }
    _network.remove(endpoint);
    return outcomes;
}

void BakeWorld::start(std::size_t i) {
    Host& host = _hosts[i];
    host.programs.push_back(std::make_unique<BakeServer>("s" + std::to_string(i), _manners[i], _random.next(), now()));
    host.runs = true;
    _network.add(host.programs.back()->node);
    _network.listen(host.programs.back()->node, "host" + std::to_string(i), kPort);
}

void BakeWorld::step() {
    _network.run(kStep);
    for (std::size_t i = 0; i < _hosts.size(); ++i) {
        Host& host = _hosts[i];
        if (host.mend && now() >= *host.mend) {
            host.mend.reset();
            if (!host.runs) start(i);
            if (std::exchange(host.isPaused, false)) _network.setPaused(host.programs.back()->node, false);
        }
        if (!host.runs || host.isPaused) continue;
        host.programs.back()->turn(now());
        _network.poke(host.programs.back()->node);
    }
    if (faults && _random.between(0, 299) == 0) fault(static_cast<std::size_t>(_random.between(0, 1 << 20)));
}

void BakeWorld::fault(std::size_t number) {
    Host& host = _hosts[number % _hosts.size()];
    if (!host.runs || host.mend) return;
    protocol::ServerNode& node = host.programs.back()->node;
    switch (_random.between(0, 3)) {
        case 0:
        case 1:
            ++killed;
            _network.remove(node);
            host.runs = false;
            break;
        case 2:
            ++paused;
            _network.setPaused(node, true);
            host.isPaused = true;
            break;
        default:
            _network.reset(node);
            return;
    }
    host.mend = now() + std::chrono::milliseconds(_random.between(50, 4000));
}

}  // namespace umbriel::sim
