#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <vector>

#include "common/wire/bytes.h"

namespace umbriel::protocol {

// Bytes on their way into a connection. Long payloads may be shared between queues: a change list is encoded once for
// all servers; short ones are copied behind each other, so that what is sent together is written together. Bounded:
// what does not fit is not taken, so a peer that stops reading costs its link, never our memory.
class SendQueue {
 public:
    explicit SendQueue(std::size_t limit) : _limit(limit) {}
    SendQueue(const SendQueue&) = delete;
    SendQueue& operator=(const SendQueue&) = delete;

    // False, and nothing is queued, when the limit would be passed.
    bool push(std::span<const std::byte> head, std::span<const std::byte> payload);
    bool push(std::span<const std::byte> head, std::shared_ptr<const wire::Bytes> payload);
    // The pieces are written from where they are: they stay there while the owner lives.
    bool push(std::span<const std::byte> head, const std::shared_ptr<const void>& owner,
              std::span<const std::span<const std::byte>> pieces);

    bool empty() const { return _size == 0; }
    std::size_t size() const { return _size; }
    // Bytes that were taken out of it so far.
    std::uint64_t written() const { return _written; }
    // The next bytes to write, in order, at most as many pieces as there is room for. Returns how many. They stay valid
    // until the queue changes.
    std::size_t gather(std::span<std::span<const std::byte>> pieces) const;
    // All of them.
    std::vector<std::span<const std::byte>> gather() const;
    // The first count bytes were written.
    void consumed(std::size_t count);

    // From now on the list gets the number when something is pushed, once until takenFromList().
    void listIn(std::deque<std::uint64_t>& list, std::uint64_t number);
    void takenFromList() { _listed = false; }

 private:
    struct Segment {
        wire::Bytes own;
        std::shared_ptr<const void> owner;  // of what is not our own
        std::span<const std::byte> shared;
        std::span<const std::byte> bytes() const { return owner ? shared : own; }
    };
    bool hasRoom(std::size_t count) const { return count <= _limit && _size <= _limit - count; }
    void append(std::span<const std::byte> bytes);
    void grown(std::size_t count);

    std::deque<Segment> _segments;  // the last one may be empty: its memory is used again
    std::size_t _consumedOfFirst = 0;
    std::size_t _size = 0;
    std::size_t _limit;
    std::uint64_t _written = 0;
    std::deque<std::uint64_t>* _list = nullptr;
    std::uint64_t _number = 0;
    bool _listed = false;
};

}  // namespace umbriel::protocol
