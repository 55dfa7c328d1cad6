#include "common/protocol/send_queue.h"

#include <utility>

#include "common/base/assert.h"

namespace umbriel::protocol {

namespace {

// Copied bytes go on in a new segment beyond this: growing one copies what is in it.
constexpr std::size_t kOwnSegment = 64 * 1024;

}  // namespace

bool SendQueue::push(std::span<const std::byte> head, std::span<const std::byte> payload) {
    const std::size_t count = head.size() + payload.size();
    if (!hasRoom(count)) return false;
    append(head);
    append(payload);
    grown(count);
    return true;
}

bool SendQueue::push(std::span<const std::byte> head, std::shared_ptr<const wire::Bytes> payload) {
    const std::size_t count = head.size() + payload->size();
    if (!hasRoom(count)) return false;
    append(head);
    const std::span<const std::byte> bytes = *payload;
    if (!bytes.empty()) _segments.push_back({{}, std::move(payload), bytes});
    grown(count);
    return true;
}

bool SendQueue::push(std::span<const std::byte> head, const std::shared_ptr<const void>& owner,
                     std::span<const std::span<const std::byte>> pieces) {
    std::size_t count = head.size();
    for (const auto piece : pieces) count += piece.size();
    if (!hasRoom(count)) return false;
    append(head);
    for (const auto piece : pieces)
        if (!piece.empty()) _segments.push_back({{}, owner, piece});
    grown(count);
    return true;
}

void SendQueue::append(std::span<const std::byte> bytes) {
    if (_segments.empty() || _segments.back().owner || _segments.back().own.size() + bytes.size() > kOwnSegment)
        _segments.emplace_back();
    wire::Bytes& own = _segments.back().own;
    own.insert(own.end(), bytes.begin(), bytes.end());
}

void SendQueue::grown(std::size_t count) {
    _size += count;
    if (_list && !std::exchange(_listed, true)) _list->push_back(_number);
}

void SendQueue::listIn(std::deque<std::uint64_t>& list, std::uint64_t number) {
    _list = &list;
    _number = number;
    if (!empty()) grown(0);
}

std::size_t SendQueue::gather(std::span<std::span<const std::byte>> pieces) const {
    std::size_t count = 0;
    std::size_t skipped = _consumedOfFirst;
    for (const Segment& segment : _segments) {
        if (count == pieces.size()) break;
        const auto bytes = segment.bytes().subspan(std::exchange(skipped, 0));
        if (!bytes.empty()) pieces[count++] = bytes;
    }
    return count;
}

std::vector<std::span<const std::byte>> SendQueue::gather() const {
    std::vector<std::span<const std::byte>> pieces(_segments.size());
    pieces.resize(gather(pieces));
    return pieces;
}

void SendQueue::consumed(std::size_t count) {
    UMBRIEL_ASSERT(count <= _size, "more was written than was queued");
    _size -= count;
    _written += count;
    while (count > 0) {
        Segment& first = _segments.front();
        const std::size_t left = first.bytes().size() - _consumedOfFirst;
        if (count < left) {
            _consumedOfFirst += count;
            return;
        }
        count -= left;
        _consumedOfFirst = 0;
        if (_segments.size() == 1 && !first.owner)
            first.own.clear();
        else
            _segments.pop_front();
    }
}

}  // namespace umbriel::protocol
