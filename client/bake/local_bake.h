#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/bake/shard_store.h"
#include "common/base/result.h"
#include "common/visibility/bake.h"
#include "common/visibility/mesh.h"

namespace umbriel {

// How bakeLocally() bakes, beside what is baked. out: the file, which appears whole or not at all.
struct LocalBakeOptions {
    std::filesystem::path out{};
    int threads = 0;                  // 0: all
    std::uint32_t shards = 0;         // how many the work is cut into, at most one a block of 1024 rows; 0: chosen
    std::optional<ShardPart> part{};  // only this part of the mesh, which makes a file to merge
    bool resume = false;              // go on with what an earlier bake into `out` has done; begin where there is none
    // Called by the caller's thread after each block, and once before the first, with blocks done and in all.
    std::function<void(std::uint64_t, std::uint64_t)> progress{};
};

// What a bake by threads of this process has made and cost.
struct LocalBakeOutcome {
    std::uint64_t rows = 0;  // of the file
    std::uint64_t rays = 0;  // traced by this process
    // Of rays, packing and files: after loading the mesh and building its tree.
    double seconds = 0.0;
    double cpuSeconds = 0.0;  // of all threads
    std::uint32_t shards = 0;
    std::uint32_t redone = 0;  // given out again: begun but not finished before, or lost or damaged since
    std::string sha256;        // of the file
};

// Bakes on threads of this process. The file is the same bytes whatever the threads, shards and interruptions, and
// appears whole or not at all.
//
// Beside it lies the folder OUT.bake while the work is going on (shard_store.h). On errors the folder stays, for
// resume. Memory beyond mesh and tree: the shards in flight, about one for each thread.
//
// Bad input: as Baker::create(); a part that the mesh does not have; OUT is being baked by another process, or was by
// one with another mesh or settings. Failure: the disk.
Result<LocalBakeOutcome> bakeLocally(const visibility::BakeMesh& mesh, const visibility::BakeSettings& settings,
                                     const LocalBakeOptions& options);

}  // namespace umbriel
