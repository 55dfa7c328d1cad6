#pragma once

#include <cstdint>
#include <map>
#include <span>

#include "common/base/hash.h"
#include "common/base/result.h"
#include "common/scene/multi_field.h"

namespace umbriel::wire {

// The name of a large multi field's content: whoever has it already need not be sent it again. The hash covers the
// element size, too (hashOfBlob), so one hash means one content cut into the same chunks.
struct BlobRef {
    Hash128 hash;
    std::uint32_t elementSize = 0;  // bytes
    std::uint64_t bytes = 0;        // of the whole content, a multiple of elementSize
    friend bool operator==(const BlobRef&, const BlobRef&) = default;
};

// A content with its name. The data shares its chunks with the field it came from.
struct Blob {
    BlobRef ref;
    MultiStorage data;
};

// XXH3-128 over the element size, the size in bytes (8 bytes each, little-endian) and the hashes of all blocks of all
// chunks (Chunk::blockHash, 16 bytes each, low word first): hashes that are kept, so that naming a content of gigabytes
// again costs little.
Hash128 hashOfBlob(const MultiStorage& data);

// Where a decoder finds the contents that a change list refers to.
class BlobSource {
 public:
    virtual ~BlobSource() = default;
    // Null when it is not there.
    virtual const MultiStorage* find(const Hash128& hash) const = 0;
};

// Contents in memory, by name. On one thread at a time.
class BlobStore : public BlobSource {
 public:
    const MultiStorage* find(const Hash128& hash) const override;
    void put(Blob blob);
    void erase(const Hash128& hash) { _blobs.erase(hash); }
    std::size_t size() const { return _blobs.size(); }

 private:
    std::map<Hash128, MultiStorage> _blobs;
};

// Puts a blob together from pieces in order, of any sizes, as they come from a peer. Takes no more memory than has
// come, but for one slab of chunks (2 MiB) or the places that were asked for.
class BlobAssembler {
 public:
    // maxBytes: a larger blob is refused at the first piece.
    BlobAssembler(const BlobRef& ref, std::uint64_t maxBytes);

    // An error when more comes than was announced.
    Result<void> add(std::span<const std::byte> piece);
    // Where what comes after the first piece belongs, and so many bytes of it were written there (MultiBuilder).
    std::size_t room(std::span<std::span<std::byte>> places) { return _data.room(places); }
    void filled(std::size_t count) { _data.filled(count); }
    bool complete() const { return _data.missing() == 0; }
    // The blob, once complete; an error when its content does not bear its name.
    Result<Blob> finish();

 private:
    BlobRef _ref;
    std::uint64_t _maxBytes;
    MultiBuilder _data;
};

}  // namespace umbriel::wire
