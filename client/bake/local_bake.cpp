#include "client/bake/local_bake.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>

#include "common/base/clock.h"
#include "common/base/processor_time.h"
#include "common/image/atomic_file.h"

namespace umbriel {
namespace {

using visibility::Baker;
using visibility::BakeSettings;
using visibility::EncodedBlock;
using visibility::kRowsPerBlock;

// Threads that bake the blocks of the open shards, in order, and write each shard when its last block is there. The
// caller's thread hears about it through next().
class Workers {
 public:
    struct Event {
        enum class Kind { Begun, Block, Written } kind;
        std::size_t shard;
    };

    Workers(const Baker& baker, const visibility::BakeMesh& mesh, const ShardStore& store, int threads)
        : _baker(baker), _mesh(mesh), _store(store), _work(store.shards().size()) {
        for (const std::size_t number : store.openShards()) {
            const Ledger::Shard& shard = store.shards()[number];
            _work[number] = std::make_unique<Work>();
            _work[number]->firstBlock = shard.firstBlock;
            _work[number]->blocks.resize(shard.blockCount);
            _work[number]->missing = shard.blockCount;
            for (std::uint32_t i = 0; i < shard.blockCount; ++i) _items.push_back({number, i});
        }
        const unsigned wanted =
            threads > 0 ? static_cast<unsigned>(threads) : std::max(1u, std::thread::hardware_concurrency());
        _running = std::min<std::size_t>(wanted, _items.size());
        for (std::size_t i = 0, count = _running; i < count; ++i) _threads.emplace_back([this] { work(); });
    }
    ~Workers() { _stop = true; }

    std::size_t blocks() const { return _items.size(); }
    // Waits. None: all is done. An error: the others stop as well.
    Result<std::optional<Event>> next() {
        std::unique_lock lock(_mutex);
        _changed.wait(lock, [&] { return _problem || !_events.empty() || _running == 0; });
        if (_problem) return *_problem;
        if (_events.empty()) return std::optional<Event>{};
        const Event event = _events.front();
        _events.pop_front();
        return std::optional(event);
    }

 private:
    struct Work {
        std::uint32_t firstBlock = 0;
        std::vector<std::vector<EncodedBlock>> blocks;
        std::atomic<std::uint32_t> missing{0};
    };
    struct Item {
        std::size_t shard;
        std::uint32_t block;
    };

    void say(Event event) {
        const std::lock_guard lock(_mutex);
        _events.push_back(event);
        _changed.notify_one();
    }

    void work() {
        for (std::size_t i = _next++; i < _items.size() && !_stop; i = _next++) {
            const Item& item = _items[i];
            Work& shard = *_work[item.shard];
            if (item.block == 0) say({Event::Kind::Begun, item.shard});
            shard.blocks[item.block] = _baker.block(shard.firstBlock + item.block);
            say({Event::Kind::Block, item.shard});
            if (--shard.missing > 0) continue;
            if (const auto written = write(item.shard); written) {
                say({Event::Kind::Written, item.shard});
            } else {
                const std::lock_guard lock(_mutex);
                if (!_problem) _problem = written.error();
                _stop = true;
            }
        }
        const std::lock_guard lock(_mutex);
        --_running;
        _changed.notify_one();
    }

    Result<void> write(std::size_t number) {
        Work& shard = *_work[number];
        std::vector<EncodedBlock> blocks;
        for (auto& part : shard.blocks) std::ranges::move(part, std::back_inserter(blocks));
        const auto bytes = visibility::assembleShard(_store.headerOf(number), _mesh.vertexRow, blocks);
        shard.blocks = {};
        if (!bytes) return bytes.error();
        return _store.write(number, *bytes);
    }

    const Baker& _baker;
    const visibility::BakeMesh& _mesh;
    const ShardStore& _store;
    std::vector<std::unique_ptr<Work>> _work;
    std::vector<Item> _items;
    std::atomic<std::size_t> _next{0};
    std::atomic<bool> _stop{false};
    std::mutex _mutex;
    std::condition_variable _changed;
    std::deque<Event> _events;
    std::optional<Error> _problem;
    std::size_t _running = 0;
    std::vector<std::jthread> _threads;  // last: joined before what they use goes
};

// Gives the shards that are not done to the workers and keeps the books.
Result<void> bakeOpenShards(const Baker& baker, const visibility::BakeMesh& mesh, ShardStore& store,
                            const LocalBakeOptions& options) {
    Workers workers(baker, mesh, store, options.threads);
    std::uint64_t done = 0;
    if (options.progress) options.progress(0, workers.blocks());
    while (true) {
        const auto event = workers.next();
        if (!event) return event.error();
        if (!*event) return {};
        Result<void> noted;
        switch ((*event)->kind) {
            case Workers::Event::Kind::Begun:
                noted = store.set((*event)->shard, Ledger::State::Leased);
                break;
            case Workers::Event::Kind::Written:
                noted = store.set((*event)->shard, Ledger::State::Done);
                break;
            case Workers::Event::Kind::Block:
                if (options.progress) options.progress(++done, workers.blocks());
                break;
        }
        if (!noted) return noted.error();
    }
}

}  // namespace

Result<LocalBakeOutcome> bakeLocally(const visibility::BakeMesh& mesh, const BakeSettings& settings,
                                     const LocalBakeOptions& options) {
    // A file that cannot be written is known before hours of work.
    if (const auto probe = AtomicFile::create(options.out); !probe) return probe.error();
    const auto baker = Baker::create(mesh, settings, options.threads);
    if (!baker) return baker.error();
    const auto planned = planShards(mesh.rows.size(), options.shards, options.part);
    if (!planned) return planned.error();
    const Duration cpuBegin = processorTime();
    const TimePoint begin = SteadyClock{}.now();

    auto store = ShardStore::open(options.out, (*baker)->header(), *planned, options.part, options.resume);
    if (!store) return store.error();
    LocalBakeOutcome outcome;
    outcome.shards = static_cast<std::uint32_t>(planned->size());
    outcome.rows = store->rows();
    outcome.redone = store->redone();
    LocalBakeOptions watched = options;
    std::uint64_t blocksDone = 0;
    watched.progress = [&](std::uint64_t done, std::uint64_t all) {
        blocksDone = done;
        if (options.progress) options.progress(done, all);
    };
    if (const auto baked = bakeOpenShards(**baker, mesh, *store, watched); !baked)
        return store->withAdvice(baked.error());
    outcome.rays = std::min(blocksDone * kRowsPerBlock, outcome.rows) * visibility::pixelCount(settings.mapping);
    auto written = store->finish();
    if (!written) return store->withAdvice(written.error());
    outcome.sha256 = *written;
    outcome.seconds = toSeconds(SteadyClock{}.now() - begin);
    outcome.cpuSeconds = toSeconds(processorTime() - cpuBegin);
    return outcome;
}

}  // namespace umbriel
