#pragma once

#include <cstdint>
#include <list>
#include <map>

#include "common/wire/blob.h"

namespace umbriel {

// The contents a server has, least recently used ones dropped beyond a budget: a client that needs one again is asked
// again. Contents share their chunks with the scene, so the budget counts what may be kept alive, not what is used. On
// one thread.
class BlobCache final : public wire::BlobSource {
 public:
    explicit BlobCache(std::uint64_t budgetBytes) : _budget(budgetBytes) {}

    const MultiStorage* find(const Hash128& hash) const override;
    // Takes part in what trim() spares longest.
    void touch(const Hash128& hash);
    void put(wire::Blob blob);
    // Drops what is beyond the budget. Not while a frame waits for the rest of its blobs.
    void trim();
    std::uint64_t bytes() const { return _bytes; }

 private:
    struct Entry {
        MultiStorage content;
        std::list<Hash128>::iterator place;
    };
    std::uint64_t _budget;
    std::uint64_t _bytes = 0;
    std::map<Hash128, Entry> _entries;
    std::list<Hash128> _order;  // least recently used first
};

}  // namespace umbriel
