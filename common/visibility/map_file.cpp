#include "common/visibility/map_file.h"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <numeric>

#include "common/base/assert.h"
#include "common/visibility/map_maker.h"
#include "common/visibility/mesh.h"

namespace umbriel::visibility {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie in memory");

constexpr std::array<char, 8> kMagic{'U', 'M', 'V', 'I', 'S', '\x1a', '\r', '\n'};
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderBytes = 256;
constexpr std::size_t kBlockEntryBytes = 48;
constexpr std::size_t kClassBytes = 64;
// Rows and vertices beyond this are a lie: 2^31 indices are the most that prepare() takes.
constexpr std::uint64_t kMostRows = std::uint64_t{1} << 32;
constexpr int kCompression = 3;
constexpr std::size_t kVerticesAtOnce = std::size_t{1} << 15;

template <class T>
void put(Bytes& out, const T& value) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    out.insert(out.end(), bytes.begin(), bytes.end());
}

// Reads in order; the caller has checked the size.
class Cursor {
 public:
    explicit Cursor(std::span<const std::byte> bytes) : _bytes(bytes) {}
    template <class T>
    T get() {
        T value;
        std::memcpy(&value, _bytes.data() + _at, sizeof(T));
        _at += sizeof(T);
        return value;
    }

 private:
    std::span<const std::byte> _bytes;
    std::size_t _at = 0;
};

std::vector<MapContent> contentsOf(std::uint32_t bits) {
    std::vector<MapContent> result;
    for (std::uint32_t bit = 1; bit <= kAllContents; bit <<= 1) {
        if (bits & bit) result.push_back(static_cast<MapContent>(bit));
    }
    return result;
}

std::uint64_t rowBlocks(std::uint64_t rows) {
    return (rows + kRowsPerBlock - 1) / kRowsPerBlock;
}

// What is known of a block without its bytes.
struct BlockEntry {
    std::uint64_t offset, storedBytes, rawBytes, storedHash, rawHash;
    std::uint32_t content, rows;
};

Hash128 contentHash(std::span<const BlockEntry> blocks) {
    Hasher128 hasher;
    for (const BlockEntry& b : blocks) {
        const std::array<std::uint64_t, 2> values{b.rawHash, std::uint64_t{b.rows} << 32 | b.content};
        hasher.add(std::as_bytes(std::span(values)));
    }
    return hasher.finish();
}

// Header and tables; blocks' offsets are filled in.
Bytes composeBeginning(MapHeader header, std::vector<BlockEntry> blocks, std::span<const std::byte> vertexTable) {
    const std::uint64_t tableOffset = kHeaderBytes;
    const std::uint64_t vertexOffset = tableOffset + blocks.size() * kBlockEntryBytes;
    std::uint64_t end = vertexOffset + vertexTable.size();
    for (BlockEntry& b : blocks) {
        b.offset = end;
        end += b.storedBytes;
    }
    header.contentHash = contentHash(blocks);
    Bytes out;
    out.reserve(vertexOffset + vertexTable.size());
    put(out, kMagic);
    put(out, kVersion);
    put(out, static_cast<std::uint32_t>(kHeaderBytes));
    put(out, header.totalRows);
    put(out, header.firstRow);
    put(out, header.rowCount);
    put(out, header.vertexCount);
    put(out, static_cast<std::uint32_t>(header.mapping.kind));
    put(out, header.mapping.size);
    put(out, header.mapping.fovy);
    put(out, static_cast<std::uint8_t>(directionFrame(header.mapping)));
    put(out, std::uint8_t{1});  // a set bit is open
    put(out, std::uint8_t{0});  // pixel 0 is the lowest bit
    put(out, static_cast<std::uint8_t>(header.guard));
    put(out, header.contents);
    put(out, header.farShare);
    put(out, pixelCount(header.mapping));
    put(out, kRowsPerBlock);
    put(out, header.meshHash);
    put(out, header.directionHash);
    put(out, header.contentHash);
    put(out, static_cast<std::uint32_t>(header.maker));
    put(out, header.environment.width);
    put(out, header.environment.height);
    put(out, std::uint32_t{0});
    std::array<char, kClassBytes> text{};
    std::copy(header.bakeClass.begin(), header.bakeClass.end(), text.begin());
    put(out, text);
    put(out, static_cast<std::uint64_t>(blocks.size()));
    put(out, static_cast<std::uint64_t>(vertexTable.size()));
    put(out, end);
    put(out, std::uint64_t{0});  // reserved
    put(out, std::uint64_t{0});  // the checksum, below
    UMBRIEL_ASSERT(out.size() == kHeaderBytes, "the header has its documented size");
    for (const BlockEntry& b : blocks) {
        put(out, b.offset);
        put(out, b.storedBytes);
        put(out, b.rawBytes);
        put(out, b.storedHash);
        put(out, b.rawHash);
        put(out, b.content);
        put(out, b.rows);
    }
    out.insert(out.end(), vertexTable.begin(), vertexTable.end());
    const std::uint64_t checksum = hash64(out);
    std::memcpy(out.data() + kHeaderBytes - 8, &checksum, 8);
    return out;
}

Bytes compress(std::span<const std::byte> raw) {
    Bytes out(ZSTD_compressBound(raw.size()));
    const std::size_t size = ZSTD_compress(out.data(), out.size(), raw.data(), raw.size(), kCompression);
    UMBRIEL_ASSERT(!ZSTD_isError(size), "the bound is large enough");
    // Stored as it is when that is not longer.
    if (size >= raw.size()) return Bytes(raw.begin(), raw.end());
    out.resize(size);
    out.shrink_to_fit();
    return out;
}

bool printable(const std::string& text) {
    return std::ranges::all_of(text, [](char c) { return c >= ' ' && c <= '~'; });
}

// Empty when the header makes sense.
std::string problem(const MapHeader& h) {
    if (const auto valid = check(h.mapping); !valid) return valid.error().message;
    if (h.totalRows == 0 || h.totalRows > kMostRows || h.vertexCount > kMostRows)
        return "impossible numbers of rows or vertices";
    if (h.firstRow % kRowsPerBlock != 0 || h.firstRow >= h.totalRows || h.rowCount == 0 ||
        h.rowCount > h.totalRows - h.firstRow ||
        (h.rowCount % kRowsPerBlock != 0 && h.firstRow + h.rowCount != h.totalRows)) {
        return fmt::format("rows {} to {} of {} are not whole blocks", h.firstRow, h.firstRow + h.rowCount,
                           h.totalRows);
    }
    if (h.contents == 0 || (h.contents & ~kAllContents) != 0) return "unknown contents";
    if (h.maker > MapMaker::Gl || h.guard > trace::Guard::FastFan) return "unknown maker or guard";
    if (!(h.farShare > 0.0)) return "the far limit is not a positive number";
    const bool index = (h.contents & static_cast<std::uint32_t>(MapContent::Index)) != 0;
    if (index ? !indexable(h.environment) : h.environment.width != 0 || h.environment.height != 0) {
        return "the environment of the index maps is impossible";
    }
    if (h.bakeClass.size() >= kClassBytes || !printable(h.bakeClass)) return "the bake class is not text";
    return {};
}

}  // namespace

std::uint64_t bytesPerRow(MapContent content, const Mapping& mapping) {
    const std::uint32_t pixels = pixelCount(mapping);
    return content == MapContent::Mask ? maskBytes(pixels) : std::uint64_t{2} * pixels;
}

EncodedBlock encodeBlock(MapContent content, std::uint32_t rows, std::span<const std::byte> raw) {
    return {content, rows, raw.size(), hash64(raw), compress(raw)};
}

Result<Bytes> assembleShard(MapHeader header, std::span<const std::uint32_t> vertexRow,
                            std::span<const EncodedBlock> blocks) {
    if (const std::string reason = problem(header); !reason.empty()) return badInput("visibility maps: " + reason);
    const std::vector<MapContent> contents = contentsOf(header.contents);
    UMBRIEL_ASSERT(blocks.size() == rowBlocks(header.rowCount) * contents.size(), "one block for each content");
    std::vector<BlockEntry> entries;
    std::uint64_t size = 0;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
        const EncodedBlock& b = blocks[i];
        UMBRIEL_ASSERT(b.content == contents[i % contents.size()], "contents in order");
        entries.push_back({0, b.stored.size(), b.rawBytes, hash64(b.stored), b.rawHash,
                           static_cast<std::uint32_t>(b.content), b.rows});
        size += b.stored.size();
    }
    Bytes vertexTable;
    if (header.firstRow == 0) {
        UMBRIEL_ASSERT(vertexRow.size() == header.vertexCount, "a row for each vertex");
        vertexTable = compress(std::as_bytes(vertexRow));
    }
    Bytes out = composeBeginning(header, std::move(entries), vertexTable);
    out.reserve(out.size() + size);
    for (const EncodedBlock& b : blocks) out.insert(out.end(), b.stored.begin(), b.stored.end());
    return out;
}

Error MapFile::damaged(const std::string& reason) const {
    return badInput(fmt::format("{}: {}; bake the maps again", _what, reason));
}

Result<MapFile> MapFile::open(std::span<const std::byte> bytes, std::string what) {
    MapFile file;
    file._what = std::move(what);
    file._bytes = bytes;
    if (bytes.size() < kMagic.size() || std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0) {
        return badInput(fmt::format("{}: not a file of visibility maps (.umvis)", file._what));
    }
    if (bytes.size() < kHeaderBytes) return file.damaged("the file ends within its header");
    Cursor in(bytes.subspan(kMagic.size()));
    if (const auto version = in.get<std::uint32_t>(); version != kVersion) {
        return badInput(
            fmt::format("{}: version {} of the format; this program reads version {}", file._what, version, kVersion));
    }
    MapHeader& h = file._header;
    const auto headerBytes = in.get<std::uint32_t>();
    h.totalRows = in.get<std::uint64_t>();
    h.firstRow = in.get<std::uint64_t>();
    h.rowCount = in.get<std::uint64_t>();
    h.vertexCount = in.get<std::uint64_t>();
    h.mapping.kind = static_cast<MappingKind>(std::min(in.get<std::uint32_t>(), 255u));
    h.mapping.size = in.get<std::uint32_t>();
    h.mapping.fovy = in.get<double>();
    const auto frame = in.get<std::uint8_t>();
    const auto sense = in.get<std::uint8_t>();
    const auto order = in.get<std::uint8_t>();
    h.guard = static_cast<trace::Guard>(in.get<std::uint8_t>());
    h.contents = in.get<std::uint32_t>();
    h.farShare = in.get<double>();
    const auto pixels = in.get<std::uint32_t>();
    const auto perBlock = in.get<std::uint32_t>();
    h.meshHash = in.get<Hash128>();
    h.directionHash = in.get<Hash128>();
    h.contentHash = in.get<Hash128>();
    h.maker = static_cast<MapMaker>(std::min(in.get<std::uint32_t>(), 255u));
    h.environment.width = in.get<std::uint32_t>();
    h.environment.height = in.get<std::uint32_t>();
    const auto reserved = in.get<std::uint32_t>();
    const auto text = in.get<std::array<char, kClassBytes>>();
    h.bakeClass.assign(text.data(), strnlen(text.data(), kClassBytes));
    const auto blockCount = in.get<std::uint64_t>();
    const auto vertexBytes = in.get<std::uint64_t>();
    const auto fileBytes = in.get<std::uint64_t>();
    const auto reservedToo = in.get<std::uint64_t>();
    const auto checksum = in.get<std::uint64_t>();

    if (fileBytes != bytes.size()) {
        return file.damaged(fmt::format("{} bytes long, but {} were written", bytes.size(), fileBytes));
    }
    if (const std::string reason = problem(h); !reason.empty()) return file.damaged(reason);
    const std::vector<MapContent> contents = contentsOf(h.contents);
    if (headerBytes != kHeaderBytes || perBlock != kRowsPerBlock || reserved != 0 || reservedToo != 0 || sense != 1 ||
        order != 0 || frame != static_cast<std::uint8_t>(directionFrame(h.mapping)) ||
        pixels != pixelCount(h.mapping) || blockCount != rowBlocks(h.rowCount) * contents.size()) {
        return file.damaged("the header contradicts itself");
    }
    const std::uint64_t room = bytes.size() - kHeaderBytes;
    if (blockCount > room / kBlockEntryBytes || vertexBytes > room - blockCount * kBlockEntryBytes) {
        return file.damaged("the tables do not fit into the file");
    }
    const std::size_t tables = kHeaderBytes + blockCount * kBlockEntryBytes;
    Bytes head(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(tables + vertexBytes));
    std::memset(head.data() + kHeaderBytes - 8, 0, 8);
    if (hash64(head) != checksum) return file.damaged("the checksum of the header and the tables is wrong");
    file._vertexTable = bytes.subspan(tables, vertexBytes);
    if ((h.firstRow == 0 && h.vertexCount > 0) != (vertexBytes > 0) || vertexBytes > h.vertexCount * 4) {
        return file.damaged("the table of vertices has an impossible size");
    }

    Cursor table(bytes.subspan(kHeaderBytes));
    std::uint64_t expected = tables + vertexBytes;
    std::vector<BlockEntry> entries;
    for (std::uint64_t i = 0; i < blockCount; ++i) {
        Block b{};
        b.offset = table.get<std::uint64_t>();
        b.storedBytes = table.get<std::uint64_t>();
        b.rawBytes = table.get<std::uint64_t>();
        b.storedHash = table.get<std::uint64_t>();
        b.rawHash = table.get<std::uint64_t>();
        b.content = table.get<std::uint32_t>();
        b.rows = table.get<std::uint32_t>();
        const std::uint64_t firstRow = i / contents.size() * kRowsPerBlock;
        const MapContent content = contents[i % contents.size()];
        if (b.content != static_cast<std::uint32_t>(content) ||
            b.rows != std::min<std::uint64_t>(kRowsPerBlock, h.rowCount - firstRow) ||
            b.rawBytes != b.rows * bytesPerRow(content, h.mapping) || b.offset != expected || b.storedBytes == 0 ||
            b.storedBytes > b.rawBytes || b.storedBytes > bytes.size() - b.offset) {
            return file.damaged(fmt::format("block {} is not where or what it must be", i));
        }
        expected += b.storedBytes;
        file._blocks.push_back(b);
        entries.push_back({b.offset, b.storedBytes, b.rawBytes, b.storedHash, b.rawHash, b.content, b.rows});
    }
    if (expected != bytes.size()) return file.damaged("there are bytes after the last block");
    if (contentHash(entries) != h.contentHash) return file.damaged("the hash of the contents is wrong");
    return file;
}

std::size_t MapFile::rowBlockCount() const {
    return static_cast<std::size_t>(rowBlocks(_header.rowCount));
}

Result<void> MapFile::belongsTo(const Hash128& meshHash) const {
    if (_header.meshHash != meshHash) {
        return badInput(fmt::format("{}: made for another mesh ({} instead of {}); bake the maps of this one", _what,
                                    toHex(_header.meshHash), toHex(meshHash)));
    }
    if (_header.directionHash != directionHash(_header.mapping)) {
        return badInput(
            fmt::format("{}: its rays have other directions than this program's mapping {} {}; bake the maps again",
                        _what, name(_header.mapping.kind), _header.mapping.size));
    }
    return {};
}

Result<std::vector<std::uint32_t>> MapFile::vertexRows(std::uint64_t vertexCount) const {
    if (_header.firstRow != 0) return badInput(fmt::format("{}: a shard without the first row has no vertices", _what));
    if (vertexCount != _header.vertexCount) {
        return badInput(
            fmt::format("{}: made for {} vertices, the mesh has {}", _what, _header.vertexCount, vertexCount));
    }
    const std::uint64_t raw = vertexCount * 4;
    std::vector<std::uint32_t> rows;
    if (_vertexTable.size() == raw) {
        rows.resize(_header.vertexCount);
        std::memcpy(rows.data(), _vertexTable.data(), raw);
    } else {
        if (ZSTD_getFrameContentSize(_vertexTable.data(), _vertexTable.size()) != raw) {
            return damaged("the table of vertices does not unpack");
        }
        rows.resize(_header.vertexCount);
        if (ZSTD_decompress(rows.data(), raw, _vertexTable.data(), _vertexTable.size()) != raw) {
            return damaged("the table of vertices does not unpack");
        }
    }
    for (const std::uint32_t row : rows) {
        if (row != kNoRow && row >= _header.totalRows) return damaged("a vertex names a row that does not exist");
    }
    return rows;
}

Result<Bytes> MapFile::read(std::size_t rowBlock, MapContent content) const {
    const std::vector<MapContent> contents = contentsOf(_header.contents);
    const auto found = std::ranges::find(contents, content);
    UMBRIEL_ASSERT(rowBlock < rowBlockCount(), "a block of this file");
    if (found == contents.end()) {
        return badInput(fmt::format("{}: does not hold this kind of map; bake it with the option for it", _what));
    }
    const std::size_t index = rowBlock * contents.size() + static_cast<std::size_t>(found - contents.begin());
    const Block& b = _blocks[index];
    const auto stored = _bytes.subspan(b.offset, b.storedBytes);
    if (hash64(stored) != b.storedHash) return damaged(fmt::format("block {} is damaged (checksum)", index));
    Bytes raw;
    if (b.storedBytes == b.rawBytes) {
        raw.assign(stored.begin(), stored.end());
    } else {
        // The frame's own size first, so that nothing is allocated for a header that lies.
        if (ZSTD_getFrameContentSize(stored.data(), stored.size()) != b.rawBytes) {
            return damaged(fmt::format("block {} does not unpack", index));
        }
        raw.resize(b.rawBytes);
        if (ZSTD_decompress(raw.data(), raw.size(), stored.data(), stored.size()) != b.rawBytes) {
            return damaged(fmt::format("block {} does not unpack", index));
        }
    }
    if (hash64(raw) != b.rawHash) return damaged(fmt::format("block {} unpacks to something else", index));
    return raw;
}

Result<void> MapFile::verifyVertexTable() const {
    if (_vertexTable.empty()) return {};
    const auto known = [&](std::span<const std::uint32_t> rows) {
        return std::ranges::all_of(rows, [&](std::uint32_t row) { return row == kNoRow || row < _header.totalRows; });
    };
    const Error unknown = damaged("a vertex names a row that does not exist");
    const std::uint64_t raw = _header.vertexCount * 4;
    // In pieces: how many vertices there are is only what the file says.
    std::vector<std::uint32_t> rows(kVerticesAtOnce);
    if (_vertexTable.size() == raw) {
        for (std::size_t at = 0; at < raw; at += kVerticesAtOnce * 4) {
            const auto piece = _vertexTable.subspan(at, std::min<std::size_t>(kVerticesAtOnce * 4, raw - at));
            std::memcpy(rows.data(), piece.data(), piece.size());
            if (!known(std::span(rows).first(piece.size() / 4))) return unknown;
        }
        return {};
    }
    const Error broken = damaged("the table of vertices does not unpack");
    if (ZSTD_getFrameContentSize(_vertexTable.data(), _vertexTable.size()) != raw) return broken;
    const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), &ZSTD_freeDCtx);
    ZSTD_inBuffer in{_vertexTable.data(), _vertexTable.size(), 0};
    std::uint64_t unpacked = 0;
    for (std::size_t left = 1; left != 0;) {
        ZSTD_outBuffer piece{rows.data(), kVerticesAtOnce * 4, 0};
        left = ZSTD_decompressStream(context.get(), &piece, &in);
        // All of the input is there, so a piece is full unless it is the last.
        if (ZSTD_isError(left) || (left != 0 && piece.pos < piece.size)) return broken;
        if (!known(std::span(rows).first(piece.pos / 4))) return unknown;
        unpacked += piece.pos;
    }
    if (unpacked != raw || in.pos != in.size) return broken;
    return {};
}

Result<void> MapFile::verify() const {
    if (const auto sound = verifyVertexTable(); !sound) return sound.error();
    for (std::size_t block = 0; block < rowBlockCount(); ++block) {
        for (const MapContent content : contentsOf(_header.contents)) {
            if (const auto raw = read(block, content); !raw) return raw.error();
        }
    }
    return {};
}

Result<MergePlan> MergePlan::make(std::span<const MapFile> shards, bool allowMixed) {
    if (shards.empty()) return badInput("no shards to merge");
    std::vector<std::size_t> order(shards.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::sort(
        order, [&](std::size_t a, std::size_t b) { return shards[a]._header.firstRow < shards[b]._header.firstRow; });
    const MapFile& first = shards[order.front()];
    MapHeader whole = first._header;
    MergePlan plan;
    std::vector<BlockEntry> entries;
    std::uint64_t next = 0;
    bool mixed = false;
    for (const std::size_t shard : order) {
        const MapFile& file = shards[shard];
        const MapHeader& h = file._header;
        // Another bake first: its rows, and what its last bits depend on, say nothing.
        MapHeader alike = h;
        alike.bakeClass = whole.bakeClass;
        alike.firstRow = whole.firstRow;
        alike.rowCount = whole.rowCount;
        alike.contentHash = whole.contentHash;
        if (alike != whole) {
            return badInput(
                fmt::format("{} and {} are not of the same bake (mesh, mapping, guard, limit or contents differ)",
                            first._what, file._what));
        }
        if (h.firstRow != next) {
            return badInput(h.firstRow > next ? fmt::format("rows {} to {} are in no shard", next, h.firstRow)
                                              : fmt::format("{}: rows from {} on are in another shard as well",
                                                            file._what, h.firstRow));
        }
        next = h.firstRow + h.rowCount;
        if (h.bakeClass != whole.bakeClass) {
            if (!allowMixed) {
                return badInput(
                    fmt::format("{} was baked by \"{}\", {} by \"{}\": last bits may differ; "
                                "--allow-mixed merges them all the same",
                                first._what, whole.bakeClass, file._what, h.bakeClass));
            }
            mixed = true;
        }
        for (const MapFile::Block& b : file._blocks) {
            entries.push_back({0, b.storedBytes, b.rawBytes, b.storedHash, b.rawHash, b.content, b.rows});
        }
        const std::uint64_t begin = file._blocks.front().offset;
        plan.pieces.push_back({shard, begin, file._bytes.size() - begin});
    }
    if (next != whole.totalRows) {
        return badInput(fmt::format("rows {} to {} are in no shard", next, whole.totalRows));
    }
    whole.rowCount = whole.totalRows;
    if (mixed) whole.bakeClass = "mixed";
    plan.beginning = composeBeginning(whole, std::move(entries), first._vertexTable);
    return plan;
}

Result<Bytes> merge(std::span<const MapFile> shards, bool allowMixed) {
    auto plan = MergePlan::make(shards, allowMixed);
    if (!plan) return plan.error();
    Bytes out = std::move(plan->beginning);
    for (const MergePlan::Piece& piece : plan->pieces) {
        const auto bytes = shards[piece.shard].bytes().subspan(piece.offset, piece.bytes);
        out.insert(out.end(), bytes.begin(), bytes.end());
    }
    return out;
}

}  // namespace umbriel::visibility
