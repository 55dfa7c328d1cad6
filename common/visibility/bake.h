#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/visibility/map_file.h"
#include "common/visibility/mesh.h"

namespace umbriel::visibility {

// What maps are made of a mesh; check() says what is possible.
struct BakeSettings {
    Mapping mapping;
    MapMaker maker = MapMaker::Rays;  // Gl: its masks come from a render server's rasteriser
    trace::Guard guard = trace::Guard::Exact;
    // How far rays go, as a share of the diagonal of the mesh; infinity: no limit.
    double farShare = 0.0;
    std::uint32_t contents = static_cast<std::uint32_t>(MapContent::Mask);
    EnvironmentSize environment;  // of MapContent::Index

    BakeSettings();
};

// Bad input: impossible mapping, limit, contents or environment; distances of a mapping without neighbours; a grid or a
// rasteriser with a guard other than Exact (they have none to choose), or with hit distances.
Result<void> check(const BakeSettings& settings);

// The header of a file of all rows: everything it says before anything is baked. bakeClass: as the bakers state it.
MapHeader wholeHeader(const BakeMesh& mesh, const BakeSettings& settings, std::string bakeClass);

// Makes maps. A block is a pure function of mesh, settings and its number: whoever bakes it, on however many threads,
// gets the same bytes (within a bake class). Immutable after create(): use from any thread.
class Baker {
 public:
    // The mesh is borrowed and must outlive the baker. threads: for building the tree; 0 takes all. Bad input for Gl.
    static Result<std::unique_ptr<Baker>> create(const BakeMesh& mesh, const BakeSettings& settings, int threads = 1);
    // For Gl: has no tree, and turns masks into blocks. `description` is who draws them, part of the bake class.
    static Result<std::unique_ptr<Baker>> createForMasks(const BakeMesh& mesh, const BakeSettings& settings,
                                                         const std::string& description);
    ~Baker();
    Baker(const Baker&) = delete;
    Baker& operator=(const Baker&) = delete;

    // Rows come in blocks of kRowsPerBlock.
    std::uint32_t rowBlocks() const;
    // Everything a shard's header says, for all rows.
    const MapHeader& header() const;

    // The contents of one block, on this thread; not for Gl. goOn is asked before each row that begins a slice of about
    // kRaysPerSlice rays, a few milliseconds, so that a server that also draws can pause; nothing comes back when it
    // says no.
    static constexpr std::uint32_t kRaysPerSlice = 32768;
    std::vector<EncodedBlock> block(std::uint32_t rowBlock, const std::function<bool()>& goOn = {}) const;
    // Rows of a block, the last one included.
    std::uint32_t rowsInBlock(std::uint32_t rowBlock) const;
    // The same from its masks, one after the other: what else is asked for is derived from them.
    std::vector<EncodedBlock> blockOfMasks(std::uint32_t rowBlock, std::span<const std::uint8_t> masks,
                                           const std::function<bool()>& goOn = {}) const;
    // A file of these rows. firstRow must be a multiple of kRowsPerBlock, rowCount too unless it ends at the last row;
    // otherwise, or beyond the mesh, bad input. threads: 0 takes all.
    Result<Bytes> shard(std::uint64_t firstRow, std::uint64_t rowCount, int threads = 1) const;

 private:
    struct State;
    explicit Baker(std::unique_ptr<State> state);
    static Result<std::unique_ptr<Baker>> make(const BakeMesh& mesh, const BakeSettings& settings, int threads,
                                               const std::string& description);
    std::unique_ptr<State> _state;
};

// One shard in one call: create() and shard().
Result<Bytes> bakeShard(const BakeMesh& mesh, const BakeSettings& settings, std::uint64_t firstRow,
                        std::uint64_t rowCount, int threads = 1);

}  // namespace umbriel::visibility
