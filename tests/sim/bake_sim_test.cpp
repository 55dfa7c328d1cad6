// A bake on virtual servers: the client's own code (coordinator, ledger, protocol) against model servers that keep the
// job table of real ones, on a network and a clock in memory, with the disk of this machine.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/bake/cluster_bake.h"
#include "client/bake/local_bake.h"
#include "common/net/memory_pump.h"
#include "common/protocol/cluster_client.h"
#include "common/protocol/server_node.h"
#include "common/visibility/bake_job.h"
#include "server/bake/job_queue.h"
#include "tests/sim/random.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/visibility/test_meshes.h"

namespace umbriel::sim {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using namespace visibility;

constexpr std::uint16_t kPort = 7420;
constexpr Duration kStep = 5ms;

std::string contentOf(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

// What all bakes here are about, baked once.
struct Subject {
    Mesh loaded = visibility::test::cloth(100, 80);
    BakeMesh mesh = *prepare(loaded);
    BakeSettings settings;
    std::unique_ptr<Baker> baker;
    std::vector<Bytes> shards;
    std::string whole;

    Subject() {
        settings.mapping = {MappingKind::HemiSphere, 8};
        baker = std::move(*Baker::create(mesh, settings));
        const std::uint64_t rows = mesh.rows.size();
        for (std::uint64_t first = 0; first < rows; first += kRowsPerBlock)
            shards.push_back(*baker->shard(first, std::min<std::uint64_t>(kRowsPerBlock, rows - first)));
        const Bytes bytes = *baker->shard(0, rows);
        whole.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    }
    std::uint64_t rowsOf(std::size_t shard) const {
        return std::min<std::uint64_t>(kRowsPerBlock, mesh.rows.size() - shard * kRowsPerBlock);
    }
};

const Subject& subject() {
    static const Subject one;
    return one;
}

enum class Manner { Honest, OtherClass, Garbage, Liar, Failing, Stalling };

// A render server as far as jobs are concerned. Its work takes virtual time.
class ModelServer {
 public:
    ModelServer(const std::string& name, Manner manner, std::uint64_t seed, TimePoint now)
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
        const Subject& s = subject();
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

// Servers, network and faults. The client is made anew for each call of bake().
class World {
 public:
    World(std::uint64_t seed, std::vector<Manner> manners)
        : _random(seed), _network({_random.next(), 100us, 3ms, _random.chance(30), 0}), _manners(std::move(manners)) {
        for (std::size_t i = 0; i < _manners.size(); ++i) {
            _hosts.emplace_back();
            start(i);
        }
    }

    bool faults = false;
    std::optional<Duration> clientDiesAfter;
    int killed = 0;
    int paused = 0;
    std::size_t mostInFlight = 0;

    TimePoint now() const { return _network.now(); }

    Result<ClusterBakeOutcome> bake(const ClusterBakeOptions& options) { return bakeInTurn({options}).front(); }

    // One client and its sessions; each is given up after `lives` of them, where that is not empty.
    std::vector<Result<ClusterBakeOutcome>> bakeInTurn(const std::vector<ClusterBakeOptions>& bakes,
                                                       const std::vector<Duration>& lives = {}) {
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
        WorldClock clock(*this);
        std::vector<Result<ClusterBakeOutcome>> outcomes;
        for (std::size_t i = 0; i < bakes.size(); ++i) {
            const Duration life = i < lives.size() ? lives[i] : clientDiesAfter.value_or(1h);
            Port port(*this, endpoint, now() + life);
            outcomes.push_back(
                bakeOnCluster(subject().loaded, subject().mesh, subject().settings, bakes[i], port, clock));
            mostInFlight = std::max(mostInFlight, port.mostInFlight);
        }
        _network.remove(endpoint);
        return outcomes;
    }

 private:
    struct Host {
        std::vector<std::unique_ptr<ModelServer>> programs;  // old ones stay: the network knows them by address
        bool runs = false;
        std::optional<TimePoint> mend;
        bool isPaused = false;
    };
    class WorldClock final : public Clock {
     public:
        explicit WorldClock(World& world) : _world(world) {}
        TimePoint now() const override { return _world.now(); }

     private:
        World& _world;
    };
    class Port final : public protocol::JobPort {
     public:
        Port(World& world, protocol::ClusterClient& client, TimePoint end)
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
        World& _world;
        protocol::ClusterClient& _client;
        TimePoint _end;
        std::size_t _inFlight = 0;
    };

    void start(std::size_t i) {
        Host& host = _hosts[i];
        host.programs.push_back(
            std::make_unique<ModelServer>("s" + std::to_string(i), _manners[i], _random.next(), now()));
        host.runs = true;
        _network.add(host.programs.back()->node);
        _network.listen(host.programs.back()->node, "host" + std::to_string(i), kPort);
    }

    void step() {
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

    void fault(std::size_t number) {
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

    Random _random;
    net::MemoryNetwork _network;
    std::vector<Manner> _manners;
    std::vector<Host> _hosts;
    std::vector<std::unique_ptr<protocol::ClusterClient>> _clients;
};

class BakeSimulation : public ::testing::Test {
 protected:
    // Thousands of synced writes: in memory where that is possible.
    static fs::path fastest() {
        const fs::path memory = "/dev/shm";
        return ::access(memory.c_str(), W_OK) == 0 ? memory : fs::temp_directory_path();
    }
    ClusterBakeOptions to(const std::string& name, double audit = 0.0) const {
        ClusterBakeOptions options{.out = folder / name, .resume = true};
        options.coordinator.auditShare = audit;
        return options;
    }
    umbriel::test::TemporaryFolder folder{fastest()};
};

TEST_F(BakeSimulation, AnyNumberOfServersMakesTheFileThatThreadsMake) {
    for (const std::size_t servers : {1u, 2u, 3u, 5u}) {
        World world(servers, std::vector<Manner>(servers, Manner::Honest));
        const auto outcome = world.bake(to("maps.umvis", 0.5));
        ASSERT_TRUE(outcome) << outcome.error().message;
        EXPECT_EQ(contentOf(folder / "maps.umvis"), subject().whole);
        EXPECT_EQ(outcome->servers, servers);
        EXPECT_EQ(outcome->redone, 0u);
        EXPECT_EQ(outcome->rays, subject().mesh.rows.size() * pixelCount(subject().settings.mapping));
        EXPECT_GE(outcome->cpuSeconds, 0.001 * outcome->shards);
        EXPECT_EQ(outcome->audited > 0, servers > 1);
        EXPECT_LE(world.mostInFlight, 3 * servers);
        EXPECT_FALSE(fs::exists(folder / "maps.umvis.bake"));
    }
    const auto local = bakeLocally(subject().mesh, subject().settings, {.out = folder / "local.umvis", .threads = 1});
    ASSERT_TRUE(local);
    EXPECT_EQ(contentOf(folder / "local.umvis"), subject().whole);
}

// UMBRIEL_SIM_BAKES seeds (300): servers that are killed, paused, cut off, that stall, fail or send garbage, and a
// client that is killed and resumes. One server is honest.
TEST_F(BakeSimulation, WhateverHappensTheFileIsTheSame) {
    const char* wanted = std::getenv("UMBRIEL_SIM_BAKES");
    const int seeds = wanted ? std::atoi(wanted) : 300;
    int killed = 0, paused = 0, clients = 0;
    std::uint64_t redone = 0, audited = 0;
    double seconds = 0.0;
    for (int seed = 1; seed <= seeds; ++seed) {
        Random random(static_cast<std::uint64_t>(seed));
        std::vector<Manner> manners{Manner::Honest};
        const std::vector<Manner> others{Manner::Honest,  Manner::Honest,  Manner::OtherClass,
                                         Manner::Garbage, Manner::Failing, Manner::Stalling};
        while (manners.size() < 5 && random.chance(70))
            manners.push_back(others[static_cast<std::size_t>(random.between(0, 5))]);
        World world(random.next(), manners);
        world.faults = random.chance(80);
        const std::string name = fmt::format("maps{}.umvis", seed);
        for (int life = 0;; ++life) {
            ASSERT_LT(life, 30) << "seed " << seed << " does not end";
            world.clientDiesAfter.reset();
            if (random.chance(50) && life < 5)
                world.clientDiesAfter = std::chrono::milliseconds(random.between(10, 4000));
            if (life > 10) world.faults = false;
            // Else the class would be whose server is there first.
            ClusterBakeOptions options = to(name, 0.2);
            options.coordinator.bakeClass = subject().baker->header().bakeClass;
            const auto outcome = world.bake(options);
            if (fs::exists(folder / name)) {
                EXPECT_EQ(contentOf(folder / name), subject().whole) << "seed " << seed;
            }
            if (outcome) {
                redone += outcome->redone;
                audited += outcome->audited;
                break;
            }
            ++clients;
            const std::string& message = outcome.error().message;
            // Only death, or nobody left at all, ends a bake.
            EXPECT_TRUE(message.find("killed") != std::string::npos || message.find("connect") != std::string::npos ||
                        message.find("reached") != std::string::npos ||
                        message.find("no server that bakes") != std::string::npos ||
                        message.find("none of the servers") != std::string::npos)
                << "seed " << seed << ": " << message;
        }
        EXPECT_EQ(contentOf(folder / name), subject().whole) << "seed " << seed;
        EXPECT_FALSE(fs::exists(folder / (name + ".bake"))) << "seed " << seed;
        killed += world.killed;
        paused += world.paused;
        seconds += toSeconds(world.now() - TimePoint{});
    }
    std::printf(
        "%d bakes in %.0f virtual s: %d servers killed, %d stopped, %d clients ended, %llu shards given out again, "
        "%llu audited\n",
        seeds, seconds, killed, paused, clients, static_cast<unsigned long long>(redone),
        static_cast<unsigned long long>(audited));
    EXPECT_GT(killed, seeds / 4);
    EXPECT_GT(clients, seeds / 4);
    EXPECT_GT(redone, 0u);
}

TEST_F(BakeSimulation, AServerThatLiesIsFoundByTheAuditAndHarmsNothing) {
    {
        World world(3, {Manner::Honest, Manner::Liar});
        const auto outcome = world.bake(to("maps.umvis", 1.0));
        ASSERT_FALSE(outcome);
        EXPECT_NE(outcome.error().message.find("differs between"), std::string::npos) << outcome.error().message;
        EXPECT_NE(outcome.error().message.find("--resume"), std::string::npos) << outcome.error().message;
        EXPECT_FALSE(fs::exists(folder / "maps.umvis"));
    }
    // What it made before it was found is audited as well when the bake goes on, and made anew.
    World world(4, {Manner::Honest, Manner::Honest});
    for (int attempt = 0; attempt < 20; ++attempt) {
        const auto outcome = world.bake(to("maps.umvis", 1.0));
        if (outcome) break;
        EXPECT_NE(outcome.error().message.find("an earlier run"), std::string::npos) << outcome.error().message;
    }
    EXPECT_EQ(contentOf(folder / "maps.umvis"), subject().whole);
}

TEST_F(BakeSimulation, OthersGoOnWithWhatAClusterHasBegunAndTheOtherWayRound) {
    World world(5, {Manner::Honest, Manner::Honest});
    world.clientDiesAfter = 2s;
    ASSERT_FALSE(world.bake(to("maps.umvis")));
    const auto local =
        bakeLocally(subject().mesh, subject().settings, {.out = folder / "maps.umvis", .threads = 1, .resume = true});
    ASSERT_TRUE(local) << local.error().message;
    EXPECT_LT(local->rays, subject().mesh.rows.size() * pixelCount(subject().settings.mapping));
    EXPECT_EQ(contentOf(folder / "maps.umvis"), subject().whole);

    const auto stopped =
        bakeLocally(subject().mesh, subject().settings,
                    {.out = folder / "more.umvis", .threads = 1, .progress = [&](std::uint64_t, std::uint64_t) {
                         fs::create_directory(folder / "more.umvis");  // a folder in place of the file
                     }});
    ASSERT_FALSE(stopped);
    fs::remove(folder / "more.umvis");
    world.clientDiesAfter.reset();
    const auto resumed = world.bake(to("more.umvis"));
    ASSERT_TRUE(resumed) << resumed.error().message;
    EXPECT_EQ(resumed->rays, 0u);
    EXPECT_EQ(contentOf(folder / "more.umvis"), subject().whole);
}

// Servers finish work of the one that was given up while they are asked for the other's.
TEST_F(BakeSimulation, OneBakeAfterAnotherInTheSameSessions) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        World world(seed, {Manner::Honest, Manner::Honest});
        const std::string name = fmt::format("maps{}.umvis", seed);
        Random random(seed);
        const auto outcomes = world.bakeInTurn({to("x" + name), to(name, 0.5), to("y" + name)},
                                               {std::chrono::milliseconds(random.between(100, 1000)), 1h, 1h});
        EXPECT_FALSE(outcomes[0]);
        for (const std::size_t i : {1u, 2u}) ASSERT_TRUE(outcomes[i]) << seed << ": " << outcomes[i].error().message;
        EXPECT_EQ(outcomes[1]->redone, 0u);
        EXPECT_EQ(contentOf(folder / name), subject().whole);
        EXPECT_EQ(contentOf(folder / ("y" + name)), subject().whole);
    }
}

TEST_F(BakeSimulation, TwoBakesIntoOneFileAndAnUnfinishedOneAreRefused) {
    World world(6, {Manner::Honest});
    std::optional<Result<LocalBakeOutcome>> second;
    ClusterBakeOptions options = to("maps.umvis");
    options.progress = [&](std::uint64_t, std::uint64_t) {
        if (!second)
            second = bakeLocally(subject().mesh, subject().settings,
                                 {.out = folder / "maps.umvis", .threads = 1, .resume = true});
    };
    ASSERT_TRUE(world.bake(options));
    ASSERT_TRUE(second && !*second);
    EXPECT_NE(second->error().message.find("another bake"), std::string::npos) << second->error().message;
    EXPECT_EQ(contentOf(folder / "maps.umvis"), subject().whole);

    world.clientDiesAfter = 1500ms;
    ASSERT_FALSE(world.bake(to("more.umvis")));
    ASSERT_TRUE(fs::exists(folder / "more.umvis.bake"));
    world.clientDiesAfter.reset();
    ClusterBakeOptions anew = to("more.umvis");
    anew.resume = false;
    const auto refused = world.bake(anew);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, Error::Kind::BadInput);
    EXPECT_NE(refused.error().message.find("--resume"), std::string::npos) << refused.error().message;
}

}  // namespace
}  // namespace umbriel::sim
