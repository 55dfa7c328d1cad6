#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "common/base/assert.h"
#include "common/base/hash.h"
#include "common/scene/chunk.h"
#include "common/scene/element_kind.h"

namespace umbriel {

// A sequence of equal-sized elements in refcounted chunks of at most 16 KiB, copied on write. Copying one costs a
// pointer per chunk, so a second aspect of a scene shares its data, and changing one vertex of a million copies one
// chunk. Chunks are immutable while shared: reading needs no lock. The last chunk is only as long as its elements.
class MultiStorage {
 public:
    static constexpr std::size_t kChunkBytes = Chunk::kMaxBytes;

    explicit MultiStorage(std::uint32_t elementSize);

    std::uint32_t elementSize() const { return _elementSize; }
    std::size_t size() const { return _size; }
    std::size_t byteSize() const { return _size * _elementSize; }
    std::size_t elementsPerChunk() const { return _elementsPerChunk; }
    std::size_t chunkCount() const { return _chunks.size(); }
    // The elements of one chunk; the last one may be shorter.
    std::span<const std::byte> chunk(std::size_t index) const;
    // Of the chunks that are full: Chunk::kBlockBytes each, the last one what is left.
    std::size_t blocksPerChunk() const {
        return (std::size_t{_elementsPerChunk} * _elementSize + Chunk::kBlockBytes - 1) / Chunk::kBlockBytes;
    }
    std::size_t blocksOfChunk(std::size_t index) const { return _chunks[index]->blocks(); }
    // Chunk::blockHash: kept with the chunk, so contents that are shared or were hashed before cost a look.
    Hash128 blockHash(std::size_t index, std::size_t block) const { return _chunks[index]->blockHash(block); }
    // True when both hold the very same chunk in memory (tests and benchmarks of sharing).
    bool sharesChunk(std::size_t index, const MultiStorage& other) const;

    // True when both consist of the very same chunks: equal without a look at the elements.
    bool sharesEverything(const MultiStorage& other) const {
        return _elementSize == other._elementSize && _size == other._size && _chunks == other._chunks;
    }

    const std::byte* element(std::size_t index) const {
        UMBRIEL_ASSERT(index < _size, "element index out of range");
        return _chunks[index / _elementsPerChunk]->bytes().data() + (index % _elementsPerChunk) * _elementSize;
    }
    // Copies elements [first, first + bytes/elementSize) out.
    void read(std::size_t first, std::span<std::byte> bytes) const;
    // The bytes [offset, offset + scratch.size()) of the whole sequence, whatever element they belong to: a view when
    // they lie in one chunk, otherwise copied into scratch.
    std::span<const std::byte> viewBytes(std::size_t offset, std::span<std::byte> scratch) const;
    // True when elements from first on are exactly these bytes.
    bool holds(std::size_t first, std::span<const std::byte> bytes) const;

    // New elements are zero bytes. Chunks of nothing but new elements share one chunk of zeros until they are written,
    // so growing costs a pointer per 16 KiB.
    void resize(std::size_t size);
    // Overwrites elements from first on; must fit.
    void write(std::size_t first, std::span<const std::byte> bytes);
    // Makes elements [first, first + count) equal to those of source, sharing whole chunks where both agree on borders.
    void copyFrom(const MultiStorage& source, std::size_t first, std::size_t count);

    // Same elements, bit for bit; shared chunks compare by address.
    bool equals(const MultiStorage& other) const;

 private:
    friend class MultiBuilder;

    std::size_t chunkElements(std::size_t chunk) const;

    std::uint32_t _elementSize;
    std::uint32_t _elementsPerChunk;
    std::size_t _size = 0;
    std::vector<ChunkHandle> _chunks;
};

// Makes a content out of bytes in order, in the memory where they stay: no copy follows, and each chunk is hashed when
// it is full. Takes no more memory than has come, but for one slab of chunks, or as many chunks as room() was asked
// for.
class MultiBuilder {
 public:
    // totalBytes: of the whole content, whole elements.
    MultiBuilder(std::uint32_t elementSize, std::uint64_t totalBytes);

    // Where the next bytes belong, one place after the other. Returns how many of the places were set; none when all
    // bytes have come. Valid until the next call.
    std::size_t room(std::span<std::span<std::byte>> places);
    // So many bytes were written into the places of room(), from the first on.
    void filled(std::size_t count);
    // Copies bytes in; there must be room for them.
    void add(std::span<const std::byte> bytes);
    std::uint64_t missing() const { return _missing; }
    // Once nothing is missing.
    MultiStorage take();

 private:
    // What is left of this chunk, which is made when it is not there.
    std::span<std::byte> roomIn(std::size_t chunk);

    MultiStorage _data;
    std::uint64_t _missing;    // bytes
    std::uint64_t _unplanned;  // bytes that no chunk was made for
    ChunkSource _source;
    std::size_t _chunk = 0;  // the first that is not full
    std::size_t _used = 0;   // bytes of it
};

// A multi field of a container: read here, written through an Edit (aspect.h).
template <class T>
class Multi {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_same_v<T, bool>,
                  "multi fields hold plain fixed-size values");

 public:
    using Element = T;

    Multi() : _storage(sizeof(T)) {}

    std::size_t size() const { return _storage.size(); }
    bool empty() const { return size() == 0; }
    T operator[](std::size_t index) const {
        T value;
        std::memcpy(&value, _storage.element(index), sizeof(T));
        return value;
    }
    // Everything, as one contiguous copy.
    std::vector<T> toVector() const {
        std::vector<T> values(size());
        _storage.read(0, std::as_writable_bytes(std::span(values)));
        return values;
    }
    const MultiStorage& storage() const { return _storage; }

 private:
    template <class>
    friend class Edit;
    friend struct FieldAccess;
    MultiStorage _storage;
};

// A single field of a container: reads like its value, written through an Edit (aspect.h).
template <class T>
class Single {
 public:
    using Element = T;

    Single() = default;
    Single(T initial) : _value(std::move(initial)) {}

    const T& get() const { return _value; }
    operator const T&() const { return _value; }
    const T* operator->() const { return &_value; }

 private:
    template <class>
    friend class Edit;
    friend struct FieldAccess;
    T _value{};
};

}  // namespace umbriel
