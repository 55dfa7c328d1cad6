#include "common/protocol/send_queue.h"

#include <utility>

#include "common/base/assert.h"

namespace umbriel::protocol {

bool SendQueue::push(wire::Bytes head, std::shared_ptr<const wire::Bytes> payload) {
    const std::size_t added = head.size() + (payload ? payload->size() : 0);
    if (added > _limit || _size > _limit - added) return false;
    _size += added;
    if (!head.empty()) _segments.push_back(std::make_shared<const wire::Bytes>(std::move(head)));
    if (payload && !payload->empty()) _segments.push_back(std::move(payload));
    return true;
}

std::vector<std::span<const std::byte>> SendQueue::gather(std::size_t maxSegments) const {
    std::vector<std::span<const std::byte>> spans;
    for (std::size_t i = 0; i < _segments.size() && i < maxSegments; ++i) {
        const std::span<const std::byte> bytes(*_segments[i]);
        spans.push_back(i == 0 ? bytes.subspan(_consumedOfFirst) : bytes);
    }
    return spans;
}

void SendQueue::consumed(std::size_t count) {
    UMBRIEL_ASSERT(count <= _size, "more was written than was queued");
    _size -= count;
    while (count > 0) {
        const std::size_t left = _segments.front()->size() - _consumedOfFirst;
        if (count < left) {
            _consumedOfFirst += count;
            return;
        }
        count -= left;
        _consumedOfFirst = 0;
        _segments.pop_front();
    }
}

}  // namespace umbriel::protocol
