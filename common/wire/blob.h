#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/base/hash.h"
#include "common/base/result.h"
#include "common/scene/change_list.h"
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

// XXH3-128 over the element size (4 bytes, little-endian) and the elements.
Hash128 hashOfBlob(const MultiStorage& data);

// Remembers hashes of fields, so that a snapshot of a scene of gigabytes does not hash it all again. It keeps the
// chunks it has hashed, by which it sees whether a field is still the same: a wrong answer is impossible. On one thread
// at a time.
class BlobHashes {
 public:
    Hash128 hashOf(ContainerId id, std::uint32_t field, const MultiStorage& data);
    // Lets go of the chunks of what these changes have changed or destroyed.
    void forget(const ChangeList& changes);

 private:
    struct Entry {
        MultiStorage data;
        Hash128 hash;
    };
    std::unordered_map<ContainerId, std::map<std::uint32_t, Entry>> _entries;
};

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
// come.
class BlobAssembler {
 public:
    // maxBytes: a larger blob is refused at the first piece.
    BlobAssembler(const BlobRef& ref, std::uint64_t maxBytes);

    // An error when more comes than was announced.
    Result<void> add(std::span<const std::byte> piece);
    bool complete() const { return _received == _ref.bytes; }
    // The blob, once complete; an error when its content does not bear its name.
    Result<Blob> finish();

 private:
    BlobRef _ref;
    std::uint64_t _maxBytes;
    std::uint64_t _received = 0;
    std::vector<std::byte> _partial;  // the first bytes of an element whose rest has not come
    MultiStorage _data;
    std::unique_ptr<Hasher128> _hasher;  // of what came, while it is in the processor's cache
};

}  // namespace umbriel::wire
