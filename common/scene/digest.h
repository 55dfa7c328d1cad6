#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "common/scene/aspect.h"

namespace umbriel {

// A digest of an aspect's state that does not depend on how the state came about: the sum, modulo 2^64, of
// XXH3(container, field, value) over single fields, and over the 1 KiB blocks of multi fields' chunks of their XXH3
// mixed with container, field and block, so it is equal after a snapshot and after any sequence of change lists that
// lead to the same graph, and costs what changed. Client and servers compare it every frame. Containers of types that
// are not shipped do not count.
class StateDigest {
 public:
    // Follows a change list that was just committed by, or applied to, the aspect. Where an applied list won over the
    // aspect's own uncommitted edits, the digest is right again with the aspect's next list.
    void update(const ChangeList& changes, const Aspect& aspect);

    std::uint64_t total() const { return _total; }
    // To name the first difference when totals disagree. 0 for what does not exist.
    std::uint64_t ofContainer(ContainerId id) const;
    std::uint64_t ofField(ContainerId id, std::uint32_t field) const;
    // Containers with their digests, ascending by id: so many of those with a greater id than after.
    std::vector<std::pair<ContainerId, std::uint64_t>> containers(ContainerId after = {},
                                                                  std::size_t count = ~std::size_t{0}) const;

 private:
    struct Entry {
        std::uint64_t sum = 0;                           // of all fields, and of existence itself
        std::vector<std::uint64_t> fields;               // sum of each field's blocks
        std::vector<std::vector<std::uint64_t>> blocks;  // of multi fields only, in their order
    };
    void add(ContainerId id, const Container& container);
    void remove(ContainerId id);
    void setField(Entry& entry, std::uint32_t field, std::uint64_t sum);

    std::unordered_map<ContainerId, Entry> _entries;
    std::uint64_t _total = 0;
};

}  // namespace umbriel
