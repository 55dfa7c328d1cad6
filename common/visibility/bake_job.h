#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/hash.h"
#include "common/base/result.h"
#include "common/visibility/bake.h"

namespace umbriel::visibility {

// What a client and a render server say to each other about a bake, as bytes: payload and result of jobs. The mesh as it
// was loaded comes beside it as two contents, positions (12 bytes each) and indices (4 bytes each), in this order.

// Get ready: take over the mesh, build the tree. The result is a BakeReadiness.
inline constexpr const char* kPrepareJob = "visibility-prepare";
// Bake rows. The result is the file of these rows, as Baker::shard() makes it.
inline constexpr const char* kShardJob = "visibility-shard";

// The payload of both jobs: which rows of which mesh, and how.
struct BakeJob {
    BakeSettings settings;
    Hash128 meshHash;       // BakeMesh::hash, as the client has it
    Hash128 directionHash;  // of the mapping, as the client has it
    std::uint64_t firstRow = 0;
    std::uint64_t rowCount = 0;  // both 0 in kPrepareJob
};
Bytes encodeBakeJob(const BakeJob& job);
// Bad input: not such bytes, or settings that check() refuses.
Result<BakeJob> decodeBakeJob(std::span<const std::byte> bytes);

// A server's answer to kPrepareJob. Files of two bake classes may differ in last bits and are not mixed.
struct BakeReadiness {
    std::string bakeClass;
    std::uint32_t slots = 1;  // shards that the server bakes at once
    Hash128 meshHash;         // of the mesh as the server has prepared it
    Hash128 directionHash;
};
Bytes encodeReadiness(const BakeReadiness& readiness);
Result<BakeReadiness> decodeReadiness(std::span<const std::byte> bytes);

}  // namespace umbriel::visibility
