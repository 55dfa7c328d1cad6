#include "common/scene/chunk.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>

#include "common/base/assert.h"

namespace umbriel {

class ChunkSlab {
 public:
    static constexpr std::size_t kBytes = std::size_t{2} << 20;

    // Null when there is no such piece of memory.
    static ChunkSlab* create() {
        void* memory = std::aligned_alloc(kBytes, kBytes);
        if (!memory) return nullptr;
        // Only a hint: without huge pages the memory is the same.
        ::madvise(memory, kBytes, MADV_HUGEPAGE);
        return new ChunkSlab(static_cast<std::byte*>(memory));
    }
    std::byte* bytes() const { return _bytes; }
    void hold() { _references.fetch_add(1, std::memory_order_relaxed); }
    void letGo() {
        if (_references.fetch_sub(1, std::memory_order_acq_rel) == 1) delete this;
    }

 private:
    explicit ChunkSlab(std::byte* bytes) : _bytes(bytes) {}
    ~ChunkSlab() { std::free(_bytes); }

    std::atomic<std::uint32_t> _references{1};
    std::byte* _bytes;
};

ChunkSource::~ChunkSource() {
    letGo();
}

void ChunkSource::letGo() {
    if (_slab) _slab->letGo();
    _slab = nullptr;
}

ChunkHandle ChunkSource::take(std::size_t bytes) {
    UMBRIEL_ASSERT(bytes > 0 && bytes <= Chunk::kMaxBytes, "chunks have a largest size");
    if (_slab && ChunkSlab::kBytes - _used < Chunk::kMaxBytes) letGo();
    if (!_slab && _expected >= ChunkSlab::kBytes / 4 * 3) {
        _slab = ChunkSlab::create();
        _used = 0;
    }
    _expected -= std::min<std::uint64_t>(_expected, bytes);
    if (!_slab) return ChunkHandle(Chunk::create(bytes, bytes));
    _slab->hold();
    ChunkHandle chunk(Chunk::create(bytes, Chunk::kMaxBytes, _slab->bytes() + _used, _slab));
    _used += Chunk::kMaxBytes;
    return chunk;
}

namespace {

std::size_t blocksOf(std::size_t bytes) {
    return (bytes + Chunk::kBlockBytes - 1) / Chunk::kBlockBytes;
}

}  // namespace

Chunk* Chunk::create(std::size_t size, std::size_t capacity, std::byte* inSlab, ChunkSlab* slab) {
    static_assert(sizeof(Chunk) % alignof(KeptHash) == 0 && alignof(KeptHash) >= alignof(std::uint64_t));
    const std::size_t hashes = blocksOf(capacity) * sizeof(KeptHash);
    auto* memory = static_cast<std::byte*>(::operator new(sizeof(Chunk) + hashes + (slab ? 0 : capacity)));
    std::byte* bytes = slab ? inSlab : memory + sizeof(Chunk) + hashes;
    auto* chunk = new (memory) Chunk(bytes, size, capacity, slab);
    for (std::size_t i = 0; i < blocksOf(capacity); ++i) new (memory + sizeof(Chunk) + i * sizeof(KeptHash)) KeptHash;
    return chunk;
}

void Chunk::destroy(Chunk* chunk) {
    if (chunk->_slab) chunk->_slab->letGo();
    chunk->~Chunk();
    ::operator delete(chunk);
}

Chunk::KeptHash& Chunk::kept(std::size_t block) const {
    auto* behind = reinterpret_cast<std::byte*>(const_cast<Chunk*>(this)) + sizeof(Chunk);
    return *std::launder(reinterpret_cast<KeptHash*>(behind + block * sizeof(KeptHash)));
}

// Two threads may hash a block at once: they keep the same value.
Hash128 Chunk::blockHash(std::size_t block) const {
    const std::uint32_t bit = 1u << block;
    KeptHash& place = kept(block);
    if (_known.load(std::memory_order_acquire) & bit)
        return {place.low.load(std::memory_order_relaxed), place.high.load(std::memory_order_relaxed)};
    const std::size_t offset = block * kBlockBytes;
    const Hash128 hash = hash128(bytes().subspan(offset, std::min(kBlockBytes, _size - offset)));
    place.low.store(hash.low, std::memory_order_relaxed);
    place.high.store(hash.high, std::memory_order_relaxed);
    _known.fetch_or(bit, std::memory_order_release);
    return hash;
}

void Chunk::forget(std::size_t offset, std::size_t count) {
    if (count == 0) return;
    const std::size_t first = offset / kBlockBytes;
    const std::size_t last = (offset + count - 1) / kBlockBytes;
    const std::uint32_t bits = (2u << last) - (1u << first);
    _known.store(_known.load(std::memory_order_relaxed) & ~bits, std::memory_order_relaxed);
}

void Chunk::keepHashesOf(const Chunk& other) {
    const std::uint32_t known = other._known.load(std::memory_order_acquire);
    std::uint32_t taken = 0;
    for (std::size_t block = 0; block < std::min(blocks(), other.blocks()); ++block) {
        const std::size_t end = (block + 1) * kBlockBytes;
        const bool sameBytes = std::min<std::size_t>(end, _size) == std::min<std::size_t>(end, other._size);
        if (!sameBytes || ((known >> block) & 1) == 0) continue;
        kept(block).low.store(other.kept(block).low.load(std::memory_order_relaxed), std::memory_order_relaxed);
        kept(block).high.store(other.kept(block).high.load(std::memory_order_relaxed), std::memory_order_relaxed);
        taken |= 1u << block;
    }
    _known.store(taken, std::memory_order_relaxed);
}

ChunkHandle ChunkHandle::zeros(std::size_t bytes) {
    ChunkHandle handle(Chunk::create(bytes, bytes));
    std::memset(handle._chunk->_bytes, 0, bytes);
    return handle;
}

void ChunkHandle::write(std::size_t offset, std::span<const std::byte> bytes, ChunkSource& source) {
    const bool whole = bytes.size() == _chunk->_size;
    if (!onlyOwner()) {
        ChunkHandle own = source.take(_chunk->_size);
        if (!whole) {
            std::memcpy(own._chunk->_bytes, _chunk->_bytes, _chunk->_size);
            own._chunk->keepHashesOf(*_chunk);
        }
        own.swap(*this);
    }
    std::memcpy(_chunk->_bytes + offset, bytes.data(), bytes.size());
    _chunk->forget(offset, bytes.size());
    // What was written as a whole will be digested as a whole: now it is in the processor's cache.
    if (whole && bytes.size() > Chunk::kMaxBytes / 2)
        for (std::size_t block = 0; block < _chunk->blocks(); ++block) _chunk->blockHash(block);
}

void ChunkHandle::resize(std::size_t bytes) {
    const std::size_t before = _chunk->_size;
    if (before == bytes) return;
    if (!onlyOwner() || bytes > _chunk->_capacity) {
        // Elements appended one by one cost amortised constant time; doubling past the chunk's end would only waste
        // memory.
        const std::size_t capacity =
            onlyOwner() ? std::max(bytes, std::min<std::size_t>(_chunk->_capacity * 2, Chunk::kMaxBytes)) : bytes;
        ChunkHandle own(Chunk::create(bytes, capacity));
        std::memcpy(own._chunk->_bytes, _chunk->_bytes, std::min(before, bytes));
        own._chunk->keepHashesOf(*_chunk);
        own.swap(*this);
    } else {
        _chunk->_size = static_cast<std::uint32_t>(bytes);
        const std::size_t kept = std::min(before, bytes);
        const std::size_t changed = kept % Chunk::kBlockBytes == 0 ? kept : kept - 1;
        _chunk->forget(changed, std::max(before, bytes) - changed);
    }
    if (bytes > before) std::memset(_chunk->_bytes + before, 0, bytes - before);
}

std::span<std::byte> ChunkHandle::fill() {
    UMBRIEL_ASSERT(onlyOwner() && _chunk->_known.load(std::memory_order_relaxed) == 0, "a chunk is filled before use");
    return {_chunk->_bytes, _chunk->_size};
}

}  // namespace umbriel
