#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "client/bake/shard_coordinator.h"
#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/protocol/job_port.h"
#include "common/visibility/bake.h"
#include "common/visibility/mesh.h"

namespace umbriel {

// How bakeOnCluster() bakes, beside what is baked. out: the file, which appears whole or not at all.
struct ClusterBakeOptions {
    std::filesystem::path out{};
    std::uint32_t shards = 0;  // as LocalBakeOptions::shards
    bool resume = false;
    CoordinatorOptions coordinator{};
    // Blocks done by all servers and in all, when that changes; first with 0 done of those that are open.
    std::function<void(std::uint64_t, std::uint64_t)> progress{};
    std::function<void(const std::string&)> notice{};  // one line for people: servers lost, refused, ...
};

// What a bake on servers has made and cost. shards, redone: as in LocalBakeOutcome; sha256: of the file, hexadecimal.
struct ClusterBakeOutcome {
    std::uint64_t rows = 0;
    std::uint64_t rays = 0;  // in shards of this call, each counted once
    // Of rays, packing, transport and files: from the first shard given out.
    double seconds = 0.0;
    double cpuSeconds = 0.0;  // of all servers for shards, and of this process
    std::uint32_t shards = 0;
    std::uint32_t redone = 0;
    std::uint32_t audited = 0;
    std::uint32_t servers = 0;  // that were ready to bake
    std::string sha256;
};

// Bakes on render servers, beside what they draw. The file is the same bytes as bakeLocally() makes within one bake
// class, whatever happens to servers on the way; the folder OUT.bake is the same too, so either may go on with what the
// other has begun. A result is taken only if it is that shard to the last byte, and recorded when it is on the disk.
// Memory beyond the mesh: the results on their way, a handful of shards.
//
// `loaded` is what `mesh` was prepared from. Bad input: as prepare() and ShardStore::open(). Failure: the disk, no
// server that bakes, servers that disagree about a shard.
Result<ClusterBakeOutcome> bakeOnCluster(visibility::Mesh loaded, const visibility::BakeMesh& mesh,
                                         const visibility::BakeSettings& settings, const ClusterBakeOptions& options,
                                         protocol::JobPort& port, const Clock& clock);

}  // namespace umbriel
