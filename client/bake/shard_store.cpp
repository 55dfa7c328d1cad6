#include "client/bake/shard_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <system_error>
#include <utility>

#include "client/bake/mapped_file.h"
#include "client/bake/sha256.h"
#include "common/image/atomic_file.h"

namespace umbriel {
namespace {

namespace fs = std::filesystem;
using visibility::kRowsPerBlock;
using visibility::MapFile;
using visibility::MapHeader;
using visibility::MergePlan;

// Enough work that syncing a file costs nothing beside it, little enough that a crash costs seconds.
constexpr std::uint32_t kBlocksPerShard = 8;
// Small meshes are cut finer: several servers find something to do.
constexpr std::uint32_t kLeastShards = 32;

constexpr const char* kClassSetting = "bake class";

// Contiguous, in order, sizes as equal as possible, none empty while count <= blocks.
Ledger::Shard cut(std::uint32_t blocks, std::uint32_t number, std::uint32_t count) {
    const auto at = [&](std::uint64_t i) { return static_cast<std::uint32_t>(i * blocks / count); };
    return {at(number), at(std::uint64_t{number} + 1) - at(number)};
}

// Everything the bytes depend on, and how the work is cut.
Ledger::Settings settingsOf(const MapHeader& h, const std::optional<ShardPart>& part, std::size_t shards) {
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
            {kClassSetting, h.bakeClass},
            {"rows", fmt::format("{}", h.totalRows)},
            {"part", part ? fmt::format("{}/{}", part->number, part->count) : "all"},
            {"number of shards", fmt::format("{}", shards)}};
}

// Numbers of the file's format as the options that set them say it.
std::string inWords(const std::string& name, const std::string& value) {
    double number = 0.0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
    if (error != std::errc() || end != value.data() + value.size()) return value;
    const auto named = [&](std::initializer_list<const char*> names) {
        return number >= 0.0 && number < static_cast<double>(names.size())
                   ? std::string(names.begin()[static_cast<std::size_t>(number)])
                   : value;
    };
    if (name == "maker") return named({"rays", "grid", "gl"});
    if (name == "guard") return named({"exact", "fast", "fast-fan"});
    if (name == "opening angle") return fmt::format("{:.6g} degrees", number * 180.0 / std::numbers::pi);
    if (name == "far limit") return std::isfinite(number) ? fmt::format("{:.6g} %", number * 100.0) : "none";
    if (name != "contents") return value;
    std::string contents;
    const auto bits = static_cast<std::uint32_t>(number);
    for (const auto& [content, text] : {std::pair{visibility::MapContent::Mask, "masks"},
                                        {visibility::MapContent::Distance, "distances"},
                                        {visibility::MapContent::HitDistance, "hit distances"},
                                        {visibility::MapContent::Index, "indices"}}) {
        if ((bits & static_cast<std::uint32_t>(content)) == 0) continue;
        contents += fmt::format("{}{}", contents.empty() ? "" : ", ", text);
    }
    return contents;
}

fs::path folderOf(const fs::path& out) {
    return fs::path(out.string() + ".bake");
}

fs::path ledgerOf(const fs::path& out) {
    return folderOf(out) / "ledger.sqlite";
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

struct MappedShards {
    std::vector<MappedFile> mapped;
    std::vector<MapFile> files;
};

Result<MappedShards> mapShards(const std::vector<fs::path>& paths) {
    MappedShards shards;
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

Result<std::string> mergeInto(const fs::path& out, const MappedShards& shards, bool allowMixed) {
    const auto plan = MergePlan::make(shards.files, allowMixed);
    if (!plan) return plan.error();
    std::vector<std::span<const std::byte>> pieces;
    for (const MergePlan::Piece& piece : plan->pieces) {
        pieces.push_back(shards.files[piece.shard].bytes().subspan(piece.offset, piece.bytes));
    }
    return writeMerged(out, plan->beginning, pieces);
}

}  // namespace

Result<std::vector<Ledger::Shard>> planShards(std::uint64_t totalRows, std::uint32_t shards,
                                              const std::optional<ShardPart>& part) {
    const auto blocks = static_cast<std::uint32_t>((totalRows + kRowsPerBlock - 1) / kRowsPerBlock);
    if (part) {
        const auto [number, count] = *part;
        if (count == 0 || number >= count) {
            return badInput(fmt::format("shard {}/{}: numbers go from 0 to one less than the count", number, count));
        }
        if (count > blocks) {
            return badInput(fmt::format("shard {}/{}: the mesh has {} blocks of {} rows, so {} shards at most", number,
                                        count, blocks, kRowsPerBlock, blocks));
        }
        return std::vector{cut(blocks, number, count)};
    }
    const std::uint32_t chosen = std::max((blocks + kBlocksPerShard - 1) / kBlocksPerShard, kLeastShards);
    const std::uint32_t count = std::min(shards > 0 ? shards : chosen, blocks);
    std::vector<Ledger::Shard> planned;
    for (std::uint32_t i = 0; i < count; ++i) planned.push_back(cut(blocks, i, count));
    return planned;
}

Result<ShardStore> ShardStore::open(const fs::path& out, const MapHeader& header,
                                    const std::vector<Ledger::Shard>& planned, const std::optional<ShardPart>& part,
                                    bool resume) {
    ShardStore store(out, header, planned, part.has_value());
    const fs::path folder = folderOf(out);
    std::error_code error;
    fs::create_directory(folder, error);
    if (error) return failure(fmt::format("cannot make the folder {}: {}", folder.string(), error.message()));
    auto ledger = Ledger::open(ledgerOf(out), out, settingsOf(header, part, planned.size()), planned, resume, inWords);
    if (!ledger) return ledger.error();
    store._ledger = std::move(*ledger);
    removeTemporaries(folder);
    for (std::size_t i = 0; i < planned.size(); ++i) {
        const Ledger::State state = store.shards()[i].state;
        if (state == Ledger::State::Planned) continue;
        if (state == Ledger::State::Done) {
            const auto mapped = MappedFile::open(store.pathOf(i));
            if (mapped && store.check(i, mapped->bytes(), store.pathOf(i).string())) continue;
        }
        ++store._redone;
        if (const auto noted = store.set(i, Ledger::State::Planned); !noted) return noted.error();
    }
    return store;
}

std::optional<std::string> ShardStore::recordedClass(const fs::path& out) {
    return Ledger::recorded(ledgerOf(out), kClassSetting);
}

std::vector<std::size_t> ShardStore::openShards() const {
    std::vector<std::size_t> open;
    for (std::size_t i = 0; i < shards().size(); ++i) {
        if (shards()[i].state != Ledger::State::Done) open.push_back(i);
    }
    return open;
}

std::uint64_t ShardStore::rowsOf(std::size_t shard) const {
    return headerOf(shard).rowCount;
}

std::uint64_t ShardStore::rows() const {
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < _planned.size(); ++i) sum += rowsOf(i);
    return sum;
}

MapHeader ShardStore::headerOf(std::size_t number) const {
    const Ledger::Shard& shard = _planned[number];
    MapHeader header = _header;
    header.firstRow = std::uint64_t{shard.firstBlock} * kRowsPerBlock;
    header.rowCount = std::min(std::uint64_t{shard.blockCount} * kRowsPerBlock, header.totalRows - header.firstRow);
    return header;
}

fs::path ShardStore::pathOf(std::size_t shard) const {
    return folderOf(_out) / fmt::format("shard-{:06}.umvis", shard);
}

Result<void> ShardStore::check(std::size_t shard, std::span<const std::byte> bytes, const std::string& what) const {
    const auto file = MapFile::open(bytes, what);
    if (!file) return file.error();
    MapHeader expected = headerOf(shard);
    expected.contentHash = file->header().contentHash;
    if (file->header() != expected) return badInput(fmt::format("{}: it is not shard {} of this bake", what, shard));
    return file->verify();
}

Result<void> ShardStore::write(std::size_t shard, std::span<const std::byte> bytes) const {
    auto file = AtomicFile::create(pathOf(shard));
    if (!file) return file.error();
    (*file)->write(bytes);
    return (*file)->commit();
}

Result<std::string> ShardStore::finish() {
    std::vector<fs::path> paths;
    for (std::size_t i = 0; i < _planned.size(); ++i) paths.push_back(pathOf(i));
    Result<std::string> written = std::string();
    {
        const auto files = mapShards(paths);
        if (!files) return files.error();
        // A part is a file as it is; only all parts together merge.
        const std::array whole{files->mapped.front().bytes()};
        written = _isPart ? writeMerged(_out, {}, whole) : mergeInto(_out, *files, false);
    }
    if (!written) return written;
    // The ledger goes last: whoever begins a bake here then finds the folder his own.
    std::error_code error;
    for (const fs::path& path : paths) fs::remove(path, error);
    if (const auto removed = _ledger->remove(); !removed) return removed.error();
    _ledger.reset();
    fs::remove(folderOf(_out), error);
    return written;
}

Error ShardStore::withAdvice(const Error& error) const {
    return Error{error.kind, fmt::format("{}; the shards that are done stay in {}, --resume goes on from there",
                                         error.message, folderOf(_out).string())};
}

Result<MergeOutcome> mergeFiles(const std::vector<fs::path>& paths, const fs::path& out, bool allowMixed) {
    const auto shards = mapShards(paths);
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
