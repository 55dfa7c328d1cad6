#include "client/bake/local_bake.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <system_error>
#include <thread>

#include "client/bake/ledger.h"
#include "client/bake/mapped_file.h"
#include "client/bake/sha256.h"
#include "common/base/clock.h"
#include "common/image/atomic_file.h"

namespace umbriel {
namespace {

namespace fs = std::filesystem;
using visibility::Baker;
using visibility::BakeSettings;
using visibility::EncodedBlock;
using visibility::kRowsPerBlock;
using visibility::MapFile;
using visibility::MapHeader;
using visibility::MergePlan;

// Enough work that syncing a file costs nothing beside it, little enough that a crash costs seconds.
constexpr std::uint32_t kBlocksPerShard = 8;

double processorSeconds() {
    timespec now{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Contiguous, in order, sizes as equal as possible, none empty while count <= blocks.
Ledger::Shard cut(std::uint32_t blocks, std::uint32_t number, std::uint32_t count) {
    const auto at = [&](std::uint64_t i) { return static_cast<std::uint32_t>(i * blocks / count); };
    return {at(number), at(std::uint64_t{number} + 1) - at(number)};
}

Result<std::vector<Ledger::Shard>> planShards(std::uint32_t blocks, const LocalBakeOptions& options) {
    if (options.part) {
        const auto [number, count] = *options.part;
        if (count == 0 || number >= count) {
            return badInput(fmt::format("shard {}/{}: numbers go from 0 to one less than the count", number, count));
        }
        if (count > blocks) {
            return badInput(fmt::format("shard {}/{}: the mesh has {} blocks of {} rows, so {} shards at most", number,
                                        count, blocks, kRowsPerBlock, blocks));
        }
        return std::vector{cut(blocks, number, count)};
    }
    const std::uint32_t wanted = options.shards > 0 ? options.shards : (blocks + kBlocksPerShard - 1) / kBlocksPerShard;
    const std::uint32_t count = std::min(wanted, blocks);
    std::vector<Ledger::Shard> shards;
    for (std::uint32_t i = 0; i < count; ++i) shards.push_back(cut(blocks, i, count));
    return shards;
}

// Everything the bytes depend on, and how the work is cut.
Ledger::Settings settingsOf(const MapHeader& h, const LocalBakeOptions& options, std::size_t shards) {
    return {{"mesh", toHex(h.meshHash)},
            {"mapping", std::string(visibility::name(h.mapping.kind))},
            {"size", fmt::format("{}", h.mapping.size)},
            {"opening angle", fmt::format("{}", h.mapping.fovy)},
            {"directions", toHex(h.directionHash)},
            {"maker", fmt::format("{}", static_cast<int>(h.maker))},
            {"guard", fmt::format("{}", static_cast<int>(h.guard))},
            {"far limit", fmt::format("{}", h.farShare)},
            {"contents", fmt::format("{}", h.contents)},
            {"environment", fmt::format("{}x{}", h.environment.width, h.environment.height)},
            {"bake class", h.bakeClass},
            {"rows", fmt::format("{}", h.totalRows)},
            {"part", options.part ? fmt::format("{}/{}", options.part->number, options.part->count) : "all"},
            {"number of shards", fmt::format("{}", shards)}};
}

fs::path folderOf(const fs::path& out) {
    return fs::path(out.string() + ".bake");
}

fs::path shardFile(const fs::path& out, std::size_t shard) {
    return folderOf(out) / fmt::format("shard-{:06}.umvis", shard);
}

bool isTemporary(const fs::path& path) {
    const std::string name = path.filename().string();
    return name.starts_with(".umbriel-") && name.ends_with(".tmp");
}

// What a killed bake left half-written. Only with the ledger's lock held.
void removeTemporaries(const fs::path& folder) {
    std::error_code error;
    std::vector<fs::path> found;
    for (fs::directory_iterator i(folder, error), end; !error && i != end; i.increment(error)) {
        if (isTemporary(i->path())) found.push_back(i->path());
    }
    for (const fs::path& path : found) fs::remove(path, error);
}

Result<void> writeFile(const fs::path& path, std::span<const std::byte> bytes) {
    auto file = AtomicFile::create(path);
    if (!file) return file.error();
    (*file)->write(bytes);
    return (*file)->commit();
}

// True when the file holds this shard of this bake, undamaged.
bool isSound(const fs::path& path, const Ledger::Shard& shard, const MapHeader& whole) {
    const auto mapped = MappedFile::open(path);
    if (!mapped) return false;
    const auto file = MapFile::open(mapped->bytes(), path.string());
    if (!file || !file->verify()) return false;
    MapHeader expected = whole;
    expected.firstRow = std::uint64_t{shard.firstBlock} * kRowsPerBlock;
    expected.rowCount = std::min(std::uint64_t{shard.blockCount} * kRowsPerBlock, whole.totalRows - expected.firstRow);
    expected.contentHash = file->header().contentHash;
    return file->header() == expected;
}

// Threads that bake the blocks of the open shards, in order, and write each shard when its last block is there. The
// caller's thread hears about it through next().
class Workers {
 public:
    struct Event {
        enum class Kind { Begun, Block, Written } kind;
        std::size_t shard;
    };

    Workers(const Baker& baker, const visibility::BakeMesh& mesh, const fs::path& out,
            const std::vector<Ledger::Shard>& shards, const std::vector<std::size_t>& open, int threads)
        : _baker(baker), _mesh(mesh), _out(out), _work(shards.size()) {
        for (const std::size_t number : open) {
            const Ledger::Shard& shard = shards[number];
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
        MapHeader header = _baker.header();
        header.firstRow = std::uint64_t{shard.firstBlock} * kRowsPerBlock;
        header.rowCount =
            std::min(std::uint64_t{shard.blocks.size()} * kRowsPerBlock, header.totalRows - header.firstRow);
        const auto bytes = visibility::assembleShard(std::move(header), _mesh.vertexRow, blocks);
        shard.blocks = {};
        if (!bytes) return bytes.error();
        return writeFile(shardFile(_out, number), *bytes);
    }

    const Baker& _baker;
    const visibility::BakeMesh& _mesh;
    const fs::path& _out;
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
Result<void> bakeOpenShards(const Baker& baker, const visibility::BakeMesh& mesh, Ledger& ledger,
                            const LocalBakeOptions& options, LocalBakeOutcome& outcome) {
    std::vector<std::size_t> open;
    const std::vector<Ledger::Shard> shards = ledger.shards();
    for (std::size_t i = 0; i < shards.size(); ++i) {
        using State = Ledger::State;
        if (shards[i].state == State::Done && isSound(shardFile(options.out, i), shards[i], baker.header())) continue;
        open.push_back(i);
        if (shards[i].state == State::Planned) continue;
        ++outcome.redone;
        if (const auto noted = ledger.set(i, State::Planned); !noted) return noted.error();
    }
    Workers workers(baker, mesh, options.out, shards, open, options.threads);
    std::uint64_t done = 0;
    if (options.progress) options.progress(0, workers.blocks());
    while (true) {
        const auto event = workers.next();
        if (!event) return event.error();
        if (!*event) return {};
        Result<void> noted;
        switch ((*event)->kind) {
            case Workers::Event::Kind::Begun:
                noted = ledger.set((*event)->shard, Ledger::State::Leased);
                break;
            case Workers::Event::Kind::Written:
                noted = ledger.set((*event)->shard, Ledger::State::Done);
                break;
            case Workers::Event::Kind::Block:
                if (options.progress) options.progress(++done, workers.blocks());
                break;
        }
        if (!noted) return noted.error();
    }
}

// Writes what the plan says; the hash of it.
Result<std::string> writeMerged(const fs::path& out, std::span<const std::byte> beginning,
                                std::span<const std::span<const std::byte>> pieces) {
    auto file = AtomicFile::create(out);
    if (!file) return file.error();
    Sha256 sha;
    const auto add = [&](std::span<const std::byte> bytes) {
        // In pieces, so that what is buffered stays small.
        constexpr std::size_t kStep = std::size_t{1} << 20;
        for (std::size_t at = 0; at < bytes.size() && !(*file)->failed(); at += kStep) {
            const auto step = bytes.subspan(at, std::min(kStep, bytes.size() - at));
            sha.add(step);
            (*file)->write(step);
        }
    };
    add(beginning);
    for (const auto& piece : pieces) add(piece);
    if (const auto committed = (*file)->commit(); !committed) return committed.error();
    return sha.finish();
}

struct OpenShards {
    std::vector<MappedFile> mapped;
    std::vector<MapFile> files;
};

Result<OpenShards> openShards(const std::vector<fs::path>& paths) {
    OpenShards shards;
    for (const fs::path& path : paths) {
        auto mapped = MappedFile::open(path);
        if (!mapped) return mapped.error();
        shards.mapped.push_back(std::move(*mapped));
        auto file = MapFile::open(shards.mapped.back().bytes(), path.string());
        if (!file) return file.error();
        shards.files.push_back(std::move(*file));
    }
    return shards;
}

Result<std::string> mergeInto(const fs::path& out, const OpenShards& shards, bool allowMixed) {
    const auto plan = MergePlan::make(shards.files, allowMixed);
    if (!plan) return plan.error();
    std::vector<std::span<const std::byte>> pieces;
    for (const MergePlan::Piece& piece : plan->pieces) {
        pieces.push_back(shards.files[piece.shard].bytes().subspan(piece.offset, piece.bytes));
    }
    return writeMerged(out, plan->beginning, pieces);
}

// The ledger goes last: whoever begins a bake here then finds the folder his own.
Result<void> cleanUp(const fs::path& out, std::unique_ptr<Ledger> ledger) {
    std::error_code error;
    for (std::size_t i = 0; i < ledger->shards().size(); ++i) fs::remove(shardFile(out, i), error);
    if (const auto removed = ledger->remove(); !removed) return removed.error();
    ledger.reset();
    fs::remove(folderOf(out), error);
    return {};
}

}  // namespace

Result<LocalBakeOutcome> bakeLocally(const visibility::BakeMesh& mesh, const BakeSettings& settings,
                                     const LocalBakeOptions& options) {
    // A file that cannot be written is known before hours of work.
    if (const auto probe = AtomicFile::create(options.out); !probe) return probe.error();
    const auto baker = Baker::create(mesh, settings, options.threads);
    if (!baker) return baker.error();
    const auto planned = planShards((*baker)->rowBlocks(), options);
    if (!planned) return planned.error();
    const double cpuBegin = processorSeconds();
    const TimePoint begin = SteadyClock{}.now();

    const fs::path folder = folderOf(options.out);
    std::error_code error;
    fs::create_directory(folder, error);
    if (error) return failure(fmt::format("cannot make the folder {}: {}", folder.string(), error.message()));
    auto ledger = Ledger::open(folder / "ledger.sqlite", options.out,
                               settingsOf((*baker)->header(), options, planned->size()), *planned, options.resume);
    if (!ledger) return ledger.error();
    removeTemporaries(folder);

    LocalBakeOutcome outcome;
    outcome.shards = static_cast<std::uint32_t>(planned->size());
    for (const Ledger::Shard& shard : *planned) {
        const std::uint64_t first = std::uint64_t{shard.firstBlock} * kRowsPerBlock;
        outcome.rows += std::min(std::uint64_t{shard.blockCount} * kRowsPerBlock, mesh.rows.size() - first);
    }
    LocalBakeOptions watched = options;
    std::uint64_t blocksDone = 0;
    watched.progress = [&](std::uint64_t done, std::uint64_t all) {
        blocksDone = done;
        if (options.progress) options.progress(done, all);
    };
    if (const auto baked = bakeOpenShards(**baker, mesh, **ledger, watched, outcome); !baked) {
        return Error{baked.error().kind,
                     fmt::format("{}; the shards that are done stay in {}, --resume goes on from there",
                                 baked.error().message, folder.string())};
    }
    outcome.rays = std::min(blocksDone * kRowsPerBlock, outcome.rows) * visibility::pixelCount(settings.mapping);

    {
        std::vector<fs::path> paths;
        for (std::size_t i = 0; i < planned->size(); ++i) paths.push_back(shardFile(options.out, i));
        const auto shards = openShards(paths);
        if (!shards) return shards.error();
        // A part is a file as it is; only all parts together merge.
        const std::array whole{shards->mapped.front().bytes()};
        auto written = options.part ? writeMerged(options.out, {}, whole) : mergeInto(options.out, *shards, false);
        if (!written) return written.error();
        outcome.sha256 = *written;
    }
    if (const auto cleaned = cleanUp(options.out, std::move(*ledger)); !cleaned) return cleaned.error();
    outcome.seconds = toSeconds(SteadyClock{}.now() - begin);
    outcome.cpuSeconds = processorSeconds() - cpuBegin;
    return outcome;
}

Result<MergeOutcome> mergeFiles(const std::vector<fs::path>& paths, const fs::path& out, bool allowMixed) {
    const auto shards = openShards(paths);
    if (!shards) return shards.error();
    for (const MapFile& file : shards->files) {
        if (const auto sound = file.verify(); !sound) return sound.error();
    }
    const auto written = mergeInto(out, *shards, allowMixed);
    if (!written) return written.error();
    MapHeader header = shards->files.front().header();
    header.firstRow = 0;
    header.rowCount = header.totalRows;
    return MergeOutcome{std::move(header), *written};
}

}  // namespace umbriel
