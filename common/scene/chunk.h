#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "common/base/hash.h"

namespace umbriel {

class ChunkHandle;

// Two MiB of memory for chunks that are filled one after the other, which the system backs by one huge page where it
// can: touching the 25 000 pages of a field of 100 MB for the first time takes longer than copying it. Lives until the
// last of its chunks is gone.
class ChunkSlab;

// Gives new chunks their memory. Large contents come in slabs, so that what is kept beyond the content stays below a
// third of it; small ones come one by one. On one thread.
class ChunkSource {
 public:
    // expectedBytes: what the chunks will hold in all.
    explicit ChunkSource(std::uint64_t expectedBytes) : _expected(expectedBytes) {}
    ~ChunkSource();
    ChunkSource(const ChunkSource&) = delete;
    ChunkSource& operator=(const ChunkSource&) = delete;
    ChunkSource(ChunkSource&& other) noexcept
        : _expected(std::exchange(other._expected, 0)), _slab(std::exchange(other._slab, nullptr)),
          _used(std::exchange(other._used, 0)) {}

    // A chunk of so many bytes (1 to Chunk::kMaxBytes) whose values are not set yet.
    ChunkHandle take(std::size_t bytes);

 private:
    void letGo();

    std::uint64_t _expected;
    ChunkSlab* _slab = nullptr;
    std::size_t _used = 0;  // of the slab, bytes
};

// A piece of a multi field's memory, shared by all that have the same elements there. Immutable while it is shared; the
// hashes of its blocks are kept with it once somebody has asked for them, so equal contents are hashed once, whoever
// digests them or names them. Any thread may read; see ChunkHandle for writing.
class Chunk {
 public:
    static constexpr std::size_t kMaxBytes = 16 * 1024;
    static constexpr std::size_t kBlockBytes = 1024;
    static constexpr std::size_t kMaxBlocks = kMaxBytes / kBlockBytes;

    Chunk(const Chunk&) = delete;
    Chunk& operator=(const Chunk&) = delete;

    std::span<const std::byte> bytes() const { return {_bytes, _size}; }
    std::size_t blocks() const { return (_size + kBlockBytes - 1) / kBlockBytes; }
    // XXH3-128 of the block's bytes; the last block may be shorter.
    Hash128 blockHash(std::size_t block) const;

 private:
    friend class ChunkHandle;
    friend class ChunkSource;

    struct KeptHash {
        std::atomic<std::uint64_t> low;
        std::atomic<std::uint64_t> high;
    };

    Chunk(std::byte* bytes, std::size_t size, std::size_t capacity, ChunkSlab* slab)
        : _size(static_cast<std::uint32_t>(size)), _capacity(static_cast<std::uint32_t>(capacity)), _bytes(bytes),
          _slab(slab) {}
    ~Chunk() = default;
    // With its hashes behind it and, without a slab, its bytes behind those.
    static Chunk* create(std::size_t size, std::size_t capacity, std::byte* inSlab = nullptr,
                         ChunkSlab* slab = nullptr);
    static void destroy(Chunk* chunk);
    KeptHash& kept(std::size_t block) const;
    // What was hashed of the bytes [offset, offset + count) does not hold any more.
    void forget(std::size_t offset, std::size_t count);
    void keepHashesOf(const Chunk& other);

    std::atomic<std::uint32_t> _references{1};
    mutable std::atomic<std::uint32_t> _known{0};  // a bit per block whose hash is kept
    std::uint32_t _size;
    std::uint32_t _capacity;
    std::byte* _bytes;
    ChunkSlab* _slab;
};

// Like std::shared_ptr<Chunk>, whose use_count() is a relaxed load: finding oneself the only owner must also order
// one's writes after the last reads of whoever let go of the chunk on another thread.
class ChunkHandle {
 public:
    ChunkHandle() = default;
    static ChunkHandle zeros(std::size_t bytes);
    ChunkHandle(const ChunkHandle& other) : _chunk(other._chunk) {
        if (_chunk) _chunk->_references.fetch_add(1, std::memory_order_relaxed);
    }
    ChunkHandle(ChunkHandle&& other) noexcept : _chunk(std::exchange(other._chunk, nullptr)) {}
    // Assigning the same chunk touches no counter: applying a list to a long field costs a comparison per chunk.
    ChunkHandle& operator=(const ChunkHandle& other) {
        if (_chunk != other._chunk) ChunkHandle(other).swap(*this);
        return *this;
    }
    ChunkHandle& operator=(ChunkHandle&& other) noexcept {
        ChunkHandle(std::move(other)).swap(*this);
        return *this;
    }
    ~ChunkHandle() {
        if (_chunk && _chunk->_references.fetch_sub(1, std::memory_order_acq_rel) == 1) Chunk::destroy(_chunk);
    }
    void swap(ChunkHandle& other) noexcept { std::swap(_chunk, other._chunk); }

    const Chunk* operator->() const { return _chunk; }
    // The very same chunk.
    friend bool operator==(const ChunkHandle&, const ChunkHandle&) = default;

    // Overwrites bytes from offset on, in a chunk of its own if this one is shared. source: where that comes from.
    void write(std::size_t offset, std::span<const std::byte> bytes, ChunkSource& source);
    // New bytes are zeros.
    void resize(std::size_t bytes);
    // The bytes of a chunk that nobody else has, for filling it; nothing of it has been hashed yet.
    std::span<std::byte> fill();

 private:
    friend class ChunkSource;
    explicit ChunkHandle(Chunk* chunk) : _chunk(chunk) {}
    bool onlyOwner() const { return _chunk->_references.load(std::memory_order_acquire) == 1; }

    Chunk* _chunk = nullptr;
};

}  // namespace umbriel
