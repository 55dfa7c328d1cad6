#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/bake/ledger.h"
#include "common/base/result.h"
#include "common/visibility/map_file.h"

namespace umbriel {

// One of n equal parts of a mesh, for job arrays; numbers begin with 0.
struct ShardPart {
    std::uint32_t number = 0;
    std::uint32_t count = 1;
};

// How a bake is cut: contiguous runs of blocks, in order, sizes as equal as possible. `shards` is how many are wanted
// (0: chosen from the blocks alone, so that whoever resumes finds the same), at most one a block; a part is one shard.
// Bad input: a part that the mesh does not have.
Result<std::vector<Ledger::Shard>> planShards(std::uint64_t totalRows, std::uint32_t shards,
                                              const std::optional<ShardPart>& part);

// A bake on the disk while it is going on, whoever bakes: the folder OUT.bake with a ledger (ledger.h) and the shards
// that are done, each synced and renamed before it is recorded; at the end one file OUT, which appears whole or not at
// all. Lives on one thread, write() apart.
class ShardStore {
 public:
    // header: of all rows, with its bake class; part: when only that is baked. Shards that the ledger calls done are
    // read to their last byte; those lost or damaged since are planned again. Errors as Ledger::open().
    static Result<ShardStore> open(const std::filesystem::path& out, const visibility::MapHeader& header,
                                   const std::vector<Ledger::Shard>& planned, const std::optional<ShardPart>& part,
                                   bool resume);
    // The bake class of what an interrupted bake into `out` has done; none when there is no such bake.
    static std::optional<std::string> recordedClass(const std::filesystem::path& out);

    const std::vector<Ledger::Shard>& shards() const { return _ledger->shards(); }
    std::vector<std::size_t> openShards() const;
    std::uint64_t rows() const;  // of all shards
    std::uint64_t rowsOf(std::size_t shard) const;
    std::uint32_t redone() const { return _redone; }  // begun but not finished before, or lost or damaged since
    // What the header of a shard's file must be, its content hash apart.
    visibility::MapHeader headerOf(std::size_t shard) const;

    // Bad input unless the bytes are that shard of this bake, to the last one. From any thread.
    Result<void> check(std::size_t shard, std::span<const std::byte> file, const std::string& what) const;
    // Synced and renamed. From any thread, for different shards at once.
    Result<void> write(std::size_t shard, std::span<const std::byte> file) const;
    std::filesystem::path pathOf(std::size_t shard) const;
    Result<void> set(std::size_t shard, Ledger::State state) { return _ledger->set(shard, state); }

    // Puts the file together and removes the folder; the SHA-256 of the file. Last call.
    Result<std::string> finish();
    // The error, with how to go on from what is done.
    Error withAdvice(const Error& error) const;

 private:
    ShardStore(std::filesystem::path out, visibility::MapHeader header, std::vector<Ledger::Shard> planned, bool isPart)
        : _out(std::move(out)), _header(std::move(header)), _planned(std::move(planned)), _isPart(isPart) {}

    std::filesystem::path _out;
    visibility::MapHeader _header;
    std::vector<Ledger::Shard> _planned;  // never changes, so that every thread may read it
    bool _isPart;
    std::unique_ptr<Ledger> _ledger;
    std::uint32_t _redone = 0;
};

// The file that a merge has written: its header, and its hash in hexadecimal.
struct MergeOutcome {
    visibility::MapHeader header;
    std::string sha256;
};
// One file of those that bakes of parts have made, in any order, each checked to the last byte. Bad input: as
// MapFile::verify() and MergePlan::make(). Failure: the disk.
Result<MergeOutcome> mergeFiles(const std::vector<std::filesystem::path>& shards, const std::filesystem::path& out,
                                bool allowMixed);

}  // namespace umbriel
