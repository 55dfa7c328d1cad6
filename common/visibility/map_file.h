#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/hash.h"
#include "common/base/result.h"
#include "common/trace/ray_scene.h"
#include "common/visibility/index_map.h"
#include "common/visibility/mapping.h"

namespace umbriel::visibility {

// Files of visibility maps, .umvis; docs/umvis.md describes every byte. A shard is a file of a run of whole blocks; all
// shards of a mesh concatenate to one file that is the same, byte for byte, however they were cut.

using Bytes = std::vector<std::byte>;

// What is stored for each row. Bits, so that a file may hold several.
enum class MapContent : std::uint32_t {
    Mask = 1,         // maskBytes() a row
    Distance = 2,     // half floats: signed angle, radians
    HitDistance = 4,  // half floats: distance of the nearest hit as a share of the diagonal, infinity where open
    Index = 8,        // 16-bit environment texels, 65535 where blocked
};
inline constexpr std::uint32_t kAllContents = 15;
std::uint64_t bytesPerRow(MapContent content, const Mapping& mapping);

enum class MapMaker : std::uint8_t { Rays = 0, Grid = 1, Gl = 2 };

inline constexpr std::uint32_t kRowsPerBlock = 1024;

// Everything about a file but its blocks.
struct MapHeader {
    std::uint64_t totalRows = 0;  // of the mesh
    std::uint64_t firstRow = 0;   // of this file: a multiple of kRowsPerBlock
    std::uint64_t rowCount = 0;   // of this file: whole blocks, or up to the last row
    std::uint64_t vertexCount = 0;
    Mapping mapping;
    MapMaker maker = MapMaker::Rays;
    trace::Guard guard = trace::Guard::Exact;
    std::uint32_t contents = static_cast<std::uint32_t>(MapContent::Mask);
    double farShare = 0.0;        // of the diagonal; infinity: no limit
    EnvironmentSize environment;  // of Index; 0 x 0 otherwise
    Hash128 meshHash;
    Hash128 directionHash;
    // What the last bits may depend on; up to 63 printable characters. Files of different classes do not merge.
    std::string bakeClass;
    // Of the uncompressed data; filled by the functions below.
    Hash128 contentHash;
    friend bool operator==(const MapHeader&, const MapHeader&) = default;
};

// One content of up to kRowsPerBlock rows as it is stored.
struct EncodedBlock {
    MapContent content = MapContent::Mask;
    std::uint32_t rows = 0;
    std::uint64_t rawBytes = 0;
    std::uint64_t rawHash = 0;
    Bytes stored;
};
EncodedBlock encodeBlock(MapContent content, std::uint32_t rows, std::span<const std::byte> raw);

// A complete file. Blocks in order of their rows, within them of their contents. vertexRow: only asked for when the
// file holds the first row, which is where the table of vertices goes.
Result<Bytes> assembleShard(MapHeader header, std::span<const std::uint32_t> vertexRow,
                            std::span<const EncodedBlock> blocks);

// A view of a file in memory, usually mapped. open() checks the header and both tables against each other, against
// their checksum and against the size of the file before anything is allocated, so that a file that lies about counts
// costs nothing; blocks are checked when they are read.
class MapFile {
 public:
    // `what` names the file in errors.
    static Result<MapFile> open(std::span<const std::byte> bytes, std::string what);

    const MapHeader& header() const { return _header; }
    std::span<const std::byte> bytes() const { return _bytes; }
    std::size_t blockCount() const { return _blocks.size(); }
    std::size_t rowBlockCount() const;
    // Bad input when the file is for another mesh, or was asked other rays than this build would ask.
    Result<void> belongsTo(const Hash128& meshHash) const;
    // Row of each loaded vertex (kNoRow: unlit); only in files that hold row 0. The caller says how many vertices his
    // mesh has, so that nothing is allocated for a number that only the file claims.
    Result<std::vector<std::uint32_t>> vertexRows(std::uint64_t vertexCount) const;
    // The uncompressed rows of a block: rows firstRow + kRowsPerBlock * rowBlock and on.
    Result<Bytes> read(std::size_t rowBlock, MapContent content) const;
    // Reads all blocks and the table of vertices.
    Result<void> verify() const;

 private:
    friend struct MergePlan;
    struct Block {
        std::uint64_t offset, storedBytes, rawBytes, storedHash, rawHash;
        std::uint32_t content, rows;
    };
    std::string _what;
    std::span<const std::byte> _bytes;
    MapHeader _header;
    std::vector<Block> _blocks;
    std::span<const std::byte> _vertexTable;  // stored

    Error damaged(const std::string& reason) const;
    Result<void> verifyVertexTable() const;
};

// How shards become one file: a new beginning, then pieces of the shards as they are, so that merging needs no memory
// for the data.
struct MergePlan {
    Bytes beginning;
    struct Piece {
        std::size_t shard = 0;
        std::uint64_t offset = 0;
        std::uint64_t bytes = 0;
    };
    std::vector<Piece> pieces;

    // Any order; together they must hold every row exactly once, and agree on everything else. allowMixed: different
    // bake classes may meet; the result says so in its own.
    static Result<MergePlan> make(std::span<const MapFile> shards, bool allowMixed = false);
};
Result<Bytes> merge(std::span<const MapFile> shards, bool allowMixed = false);

}  // namespace umbriel::visibility
