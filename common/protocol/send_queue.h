#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <span>
#include <vector>

#include "common/wire/bytes.h"

namespace umbriel::protocol {

// Bytes on their way into a connection. Payloads may be shared between queues: a change list is encoded once for all
// servers. Bounded: what does not fit is not taken, so a peer that stops reading costs its link, never our memory.
class SendQueue {
 public:
    explicit SendQueue(std::size_t limit) : _limit(limit) {}

    // False, and nothing is queued, when the limit would be passed.
    bool push(wire::Bytes head, std::shared_ptr<const wire::Bytes> payload = nullptr);

    bool empty() const { return _segments.empty(); }
    std::size_t size() const { return _size; }
    // The next bytes to write, in order, at most maxSegments pieces. They stay valid until consumed.
    std::vector<std::span<const std::byte>> gather(std::size_t maxSegments) const;
    // The first count bytes were written.
    void consumed(std::size_t count);

 private:
    std::deque<std::shared_ptr<const wire::Bytes>> _segments;
    std::size_t _consumedOfFirst = 0;
    std::size_t _size = 0;
    std::size_t _limit;
};

}  // namespace umbriel::protocol
