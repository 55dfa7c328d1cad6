#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/scene/container_id.h"
#include "common/scene/type_descriptor.h"

namespace umbriel {

// Elements first to first + count - 1 of an array.
struct IndexRange {
    std::size_t first = 0;
    std::size_t count = 0;
    friend bool operator==(const IndexRange&, const IndexRange&) = default;
};

// A set of element indices as sorted, disjoint, non-adjacent ranges. Beyond kMaxRanges the two with the smallest gap
// between them are joined: shipping a few unchanged elements is cheaper than unbounded bookkeeping.
class IndexRanges {
 public:
    static constexpr std::size_t kMaxRanges = 1024;

    void add(std::size_t first, std::size_t count);
    void add(const IndexRanges& other);
    // Forgets indices at or above size.
    void clampTo(std::size_t size);
    bool empty() const { return _ranges.empty(); }
    const std::vector<IndexRange>& ranges() const { return _ranges; }
    std::size_t elementCount() const;

 private:
    std::vector<IndexRange> _ranges;
};

// What changed in a multi field: the touched elements; its size is read from the aspect when the list is used.
struct MultiChange {
    std::uint32_t field = 0;
    IndexRanges touched;
};

// Which fields of a container changed.
struct ContainerChange {
    ContainerId id;
    FieldMask fields = 0;             // single and multi fields that changed
    std::vector<MultiChange> multis;  // sorted by field; one for every multi field in the mask
};

// A container that is new. Its fields have their defaults until a change says otherwise.
struct ContainerCreation {
    ContainerId id;
    std::uint32_t type = 0;  // TypeDescriptor::index
};

// What happened to an aspect between two commits, coalesced: a field changed a hundred times is one entry, a container
// created and destroyed in between is none. It names what changed; the values are read from the aspect it came from, so
// it must be used before that aspect is edited again. Applied in the order created, changed, destroyed, every reference
// resolves.
struct ChangeList {
    std::vector<ContainerCreation> created;     // in order of creation
    std::vector<ContainerChange> changed;       // sorted by id
    std::vector<ContainerId> destroyed;         // in order of destruction
    std::vector<std::uint32_t> destroyedTypes;  // TypeDescriptor::index of each: it can no longer be looked up

    bool empty() const { return created.empty() && changed.empty() && destroyed.empty(); }
    std::size_t entryCount() const { return created.size() + changed.size() + destroyed.size(); }
};

}  // namespace umbriel
