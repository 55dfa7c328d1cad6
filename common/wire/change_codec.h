#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/scene/aspect.h"
#include "common/wire/blob.h"
#include "common/wire/bytes.h"

namespace umbriel::wire {

// Change lists as bytes. A list is cut into parts of bounded size; parts are applied in order, each can be decoded
// without the others:
//
//     part   = varint number of blobs, { u64 hash low, u64 hash high, varint element size, varint bytes }, entry...
//     entry  = varint (zigzag(id - id of the entry before, 0 at first) << 2 | op), then by op
//              0 create:  varint type
//              1 change:  varint type, varint field mask, the fields in their order
//              2 destroy: nothing
//     field  = single: its bytes as in memory (little-endian, packed); String: varint length, bytes
//              multi:  varint size in elements, varint (n << 2 | form), then by form
//                      0 ranges: n times { varint gap from the end of the range before, varint count, elements };
//                                the field gets this size
//                      1 blob:   nothing; the field becomes blob n of the part's table
//                      2 more:   ranges of a long write; other entries follow with the rest. The field is not cut to
//                                this size yet, only grown to the end of these ranges
//
// A field never grows by elements that do not come with it, so that a decoder's memory is bounded by what it was sent.

inline constexpr std::uint64_t kMaxContainerId = (std::uint64_t{1} << 60) - 1;

// How a change list is cut into messages and contents (bytes).
struct EncodeOptions {
    bool includeUnshipped = false;           // types that stay on the client, too (from an import child process)
    std::size_t blobThreshold = 32 * 1024;   // multi fields of so many bytes, written as a whole, become blobs
    std::size_t maxPartBytes = 1024 * 1024;  // at least 512; one text alone may need up to kMaxTextBytes more
};

// A change list as messages carry it.
struct EncodedChanges {
    std::vector<Bytes> parts;     // none when there is nothing to say
    std::size_t entries = 0;      // creations, changes and destructions of the list that are in
    std::vector<Blob> blobs;      // what the parts refer to, each once
    std::uint64_t bytes() const;  // of all parts together, without blobs
};

// The list must have been committed by (or be a snapshot of) this aspect as it is now.
EncodedChanges encodeChanges(const ChangeList& changes, const Aspect& aspect, const EncodeOptions& options = {});

// What a decoder accepts. The defaults are what a scene of a big wall may take, not what a machine has.
struct DecodeLimits {
    bool acceptUnshipped = false;                           // see EncodeOptions::includeUnshipped
    std::size_t maxContainers = 16'000'000;                 // in the aspect
    std::uint64_t maxFieldBytes = std::uint64_t{4} << 30;   // of one multi field
    std::uint64_t maxMultiBytes = std::uint64_t{64} << 30;  // of all multi fields in the aspect
};

// The blobs a part refers to: what must be there before it is applied.
Result<std::vector<BlobRef>> blobsReferenced(std::span<const std::byte> part, const DecodeLimits& limits = {});

// Turns parts from a peer into edits of an aspect, which records them for its next commit. The bytes may be hostile:
// nothing is believed that is not checked, and every error says which entry is wrong and why. After an error the aspect
// may hold some of the part: it is of no use any more (the session ends). Nothing else edits the aspect meanwhile.
class ChangeDecoder {
 public:
    explicit ChangeDecoder(Aspect& into, const DecodeLimits& limits = {});

    Result<void> apply(std::span<const std::byte> part, const BlobSource& blobs);

 private:
    Aspect& _aspect;
    DecodeLimits _limits;
    std::uint64_t _multiBytes = 0;  // of all multi fields in the aspect
};

// One part, without a decoder that is kept: looks at every container of the aspect first.
Result<void> applyChanges(std::span<const std::byte> part, Aspect& into, const BlobSource& blobs,
                          const DecodeLimits& limits = {});

}  // namespace umbriel::wire
