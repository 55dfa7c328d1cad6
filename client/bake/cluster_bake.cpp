#include "client/bake/cluster_bake.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "client/bake/mapped_file.h"
#include "client/bake/shard_store.h"
#include "common/base/processor_time.h"
#include "common/image/atomic_file.h"
#include "common/visibility/bake_job.h"

namespace umbriel {
namespace {

using protocol::JobNews;
using visibility::BakeJob;
using visibility::kRowsPerBlock;

constexpr Duration kLongestWait = std::chrono::seconds(1);

template <class Element>
wire::Blob blobOf(std::vector<Element> elements) {
    wire::Blob blob{{}, MultiStorage(sizeof(Element))};
    blob.data.resize(elements.size());
    blob.data.write(0, std::as_bytes(std::span(elements)));
    blob.ref = {wire::hashOfBlob(blob.data), sizeof(Element), blob.data.byteSize()};
    return blob;
}

std::vector<std::byte> bytesOf(const MultiStorage& data) {
    std::vector<std::byte> bytes(data.byteSize());
    data.read(0, bytes);
    return bytes;
}

// One bake, on the caller's thread.
class Run {
 public:
    Run(const visibility::BakeMesh& mesh, const visibility::BakeSettings& settings, const ClusterBakeOptions& options,
        protocol::JobPort& port, const Clock& clock)
        : _mesh(mesh),
          _options(options),
          _port(port),
          _clock(clock),
          _coordinator(withSeed(options.coordinator, mesh.hash), port.serverCount(), clock.now()) {
        _job.settings = settings;
        _job.meshHash = mesh.hash;
        _job.directionHash = visibility::directionHash(settings.mapping);
    }

    Result<ClusterBakeOutcome> bake(visibility::Mesh loaded, std::vector<Ledger::Shard> planned) {
        _planned = std::move(planned);
        std::vector<wire::Blob> blobs;
        blobs.push_back(blobOf(std::exchange(loaded.positions, {})));
        blobs.push_back(blobOf(std::exchange(loaded.indices, {})));
        for (const wire::Blob& blob : blobs) _blobs.push_back(blob.ref);
        _series = std::uint64_t{_port.provide(std::move(blobs))} << 32;
        const Result<void> done = serve();
        takeBack();
        _port.finish();
        if (!done) {
            if (_store && _coordinator.disputedShard()) {
                // Neither of the two is believed: a resumed bake makes it anew. The first error counts.
                (void)_store->set(*_coordinator.disputedShard(), Ledger::State::Planned);
            }
            return _store ? _store->withAdvice(done.error()) : done.error();
        }
        auto written = _store->finish();
        if (!written) return _store->withAdvice(written.error());
        _outcome.sha256 = *written;
        _outcome.shards = static_cast<std::uint32_t>(_planned.size());
        _outcome.redone = _redoneBefore + _coordinator.redone();
        _outcome.audited = _coordinator.audited();
        _outcome.servers = static_cast<std::uint32_t>(_coordinator.participants());
        _outcome.seconds = toSeconds(_clock.now() - _begin);
        _outcome.cpuSeconds += toSeconds(processorTime() - _processorBegin);
        return std::move(_outcome);
    }

 private:
    static CoordinatorOptions withSeed(CoordinatorOptions options, const Hash128& mesh) {
        options.auditSeed = mesh.low ^ mesh.high;
        return options;
    }

    Result<void> serve() {
        for (;;) {
            _coordinator.advance(_clock.now());
            if (!_store && !_coordinator.bakeClass().empty() && !_coordinator.error())
                if (const auto begun = begin(); !begun) return begun;
            for (const std::string& notice : _coordinator.takeNotices())
                if (_options.notice) _options.notice(notice);
            if (_coordinator.error()) return *_coordinator.error();
            if (_coordinator.isFinished()) return {};
            if (const auto sent = send(); !sent) return sent;
            if (_store) tellProgress();
            auto news = _port.wait(std::clamp(_coordinator.deadline() - _clock.now(), Duration{0}, kLongestWait));
            if (!news) return news.error();
            for (JobNews& one : *news)
                if (const auto handled = handle(one); !handled) return handled;
        }
    }

    // The class is known: so is everything about the file but its contents.
    Result<void> begin() {
        auto store =
            ShardStore::open(_options.out, visibility::wholeHeader(_mesh, _job.settings, _coordinator.bakeClass()),
                             _planned, std::nullopt, _options.resume);
        if (!store) return store.error();
        _store.emplace(std::move(*store));
        std::vector<ShardCoordinator::Known> known(_planned.size());
        for (std::size_t i = 0; i < _planned.size(); ++i) {
            known[i].done = _store->shards()[i].state == Ledger::State::Done;
            if (!known[i].done) _openBlocks += _planned[i].blockCount;
            if (!known[i].done || !_coordinator.isAudited(i)) continue;
            const auto file = MappedFile::open(_store->pathOf(i));
            if (!file) return file.error();
            known[i].hash = blobOf(std::vector<std::byte>(file->bytes().begin(), file->bytes().end())).ref.hash;
        }
        _baked.assign(_planned.size(), false);
        for (std::size_t i = 0; i < known.size(); ++i) _baked[i] = known[i].done;
        _outcome.rows = _store->rows();
        _redoneBefore = _store->redone();
        _begin = _clock.now();
        _processorBegin = processorTime();
        _coordinator.start(known, _begin);
        if (_options.progress) _options.progress(0, _openBlocks);
        return {};
    }

    // Servers need not work on what nobody waits for.
    void takeBack() {
        _coordinator.cancelAll();
        while (const auto order = _coordinator.nextOrder())
            if (order->kind == ShardCoordinator::Order::Kind::Cancel)
                _port.cancel(order->peer, _series | order->job, order->attempt);
    }

    Result<void> send() {
        using Kind = ShardCoordinator::Order::Kind;
        while (const auto order = _coordinator.nextOrder()) {
            switch (order->kind) {
                case Kind::Cancel:
                    _port.cancel(order->peer, _series | order->job, order->attempt);
                    break;
                case Kind::Fetch:
                    _port.fetch(order->peer, order->result);
                    break;
                case Kind::Prepare:
                case Kind::Bake: {
                    BakeJob job = _job;
                    const bool bakes = order->kind == Kind::Bake;
                    if (bakes) {
                        const visibility::MapHeader header = _store->headerOf(order->shard);
                        job.firstRow = header.firstRow;
                        job.rowCount = header.rowCount;
                        if (!order->audit)
                            if (const auto noted = _store->set(order->shard, Ledger::State::Leased); !noted)
                                return noted;
                    }
                    _port.offer(order->peer, {_series | order->job, order->attempt, order->lease,
                                              bakes ? visibility::kShardJob : visibility::kPrepareJob,
                                              visibility::encodeBakeJob(job), _blobs});
                    break;
                }
            }
        }
        return {};
    }

    Result<void> handle(JobNews& news) {
        const TimePoint now = _clock.now();
        switch (news.kind) {
            case JobNews::Kind::Begun:
                _names.resize(std::max(_names.size(), news.peer.server + 1));
                _names[news.peer.server] = news.text;
                _coordinator.sessionBegun(news.peer, news.text, now);
                return {};
            case JobNews::Kind::Ended:
                _coordinator.sessionEnded(news.peer, news.text, now);
                return {};
            case JobNews::Kind::Lease:
                if (!isOurs(news.lease.job)) return {};
                news.lease.job ^= _series;
                _coordinator.leased(news.peer, news.lease, now);
                return {};
            case JobNews::Kind::Done:
                if (!isOurs(news.done.job)) return {};
                news.done.job ^= _series;
                if (news.done.job != ShardCoordinator::kPrepareJob)
                    _outcome.cpuSeconds += static_cast<double>(news.done.cpuMicroseconds) * 1e-6;
                _coordinator.jobDone(news.peer, news.done, now);
                return {};
            case JobNews::Kind::Result: {
                const auto job = _coordinator.fetched(news.peer, news.result.ref.hash);
                if (!job) return {};
                if (*job == ShardCoordinator::kPrepareJob) {
                    readiness(news);
                    return {};
                }
                return result(news, *job - 1);
            }
        }
        return {};
    }

    // Not of a bake before this one in the same session.
    bool isOurs(std::uint64_t job) const { return job >> 32 == _series >> 32; }

    void readiness(const JobNews& news) {
        const auto ready = visibility::decodeReadiness(bytesOf(news.result.data));
        if (!ready) return _coordinator.refused(news.peer, ready.error().message);
        if (ready->meshHash != _job.meshHash || ready->directionHash != _job.directionHash)
            return _coordinator.refused(news.peer, "it prepares the mesh or the directions differently");
        _coordinator.ready(news.peer, ready->bakeClass, ready->slots, _clock.now());
    }

    Result<void> result(const JobNews& news, std::size_t shard) {
        const std::vector<std::byte> bytes = bytesOf(news.result.data);
        const std::string what = fmt::format("what server '{}' sends", _names[news.peer.server]);
        if (const auto sound = _store->check(shard, bytes, what); !sound) {
            _coordinator.spoilt(news.peer, shard, sound.error().message);
            return {};
        }
        if (_coordinator.isDone(shard)) {
            _coordinator.dissented(news.peer, shard);
            return {};
        }
        if (const auto written = _store->write(shard, bytes); !written) return written;
        if (const auto noted = _store->set(shard, Ledger::State::Done); !noted) return noted;
        _outcome.rays += _store->rowsOf(shard) * visibility::pixelCount(_job.settings.mapping);
        _coordinator.stored(news.peer, shard, _clock.now());
        return {};
    }

    void tellProgress() {
        double blocks = 0.0;
        for (std::size_t i = 0; i < _planned.size(); ++i)
            if (!_baked[i]) blocks += static_cast<double>(_coordinator.progressOf(i)) * _planned[i].blockCount;
        const auto done = std::min(static_cast<std::uint64_t>(blocks + 1e-3), _openBlocks);
        if (done <= _told) return;
        _told = done;
        if (_options.progress) _options.progress(done, _openBlocks);
    }

    const visibility::BakeMesh& _mesh;
    const ClusterBakeOptions& _options;
    protocol::JobPort& _port;
    const Clock& _clock;
    ShardCoordinator _coordinator;
    BakeJob _job;
    std::uint64_t _series = 0;  // in the upper half of the numbers of jobs
    std::vector<wire::BlobRef> _blobs;
    std::vector<Ledger::Shard> _planned;
    std::optional<ShardStore> _store;
    std::vector<std::string> _names;
    std::vector<bool> _baked;  // before this call
    std::uint64_t _openBlocks = 0;
    std::uint64_t _told = 0;
    std::uint32_t _redoneBefore = 0;
    TimePoint _begin;
    Duration _processorBegin{};
    ClusterBakeOutcome _outcome;
};

}  // namespace

Result<ClusterBakeOutcome> bakeOnCluster(visibility::Mesh loaded, const visibility::BakeMesh& mesh,
                                         const visibility::BakeSettings& settings, const ClusterBakeOptions& options,
                                         protocol::JobPort& port, const Clock& clock) {
    if (const auto valid = visibility::check(settings); !valid) return valid.error();
    // A file that cannot be written is known before hours of work.
    if (const auto probe = AtomicFile::create(options.out); !probe) return probe.error();
    auto planned = planShards(mesh.rows.size(), options.shards, std::nullopt);
    if (!planned) return planned.error();
    ClusterBakeOptions chosen = options;
    // What is done already decides who may go on with it.
    if (options.resume && chosen.coordinator.bakeClass.empty())
        chosen.coordinator.bakeClass = ShardStore::recordedClass(options.out).value_or("");
    Run run(mesh, settings, chosen, port, clock);
    return run.bake(std::move(loaded), std::move(*planned));
}

}  // namespace umbriel
