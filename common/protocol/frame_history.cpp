#include "common/protocol/frame_history.h"

#include <algorithm>
#include <utility>

#include "common/base/assert.h"
#include "common/wire/messages.h"

namespace umbriel::protocol {

std::shared_ptr<const FrameChanges> packChanges(std::uint64_t number, std::vector<wire::Bytes> parts,
                                                std::map<Hash128, MultiStorage> blobs) {
    auto packed = std::make_shared<FrameChanges>();
    packed->number = number;
    packed->blobs = std::move(blobs);
    for (const auto& [hash, content] : packed->blobs) {
        packed->bytes += content.byteSize();
        packed->longestBlob = std::max<std::uint64_t>(packed->longestBlob, content.byteSize());
    }
    for (std::size_t i = 0; i < parts.size(); ++i) {
        packed->bytes += parts[i].size();
        packed->changeBytes += parts[i].size();
        if (i + 1 == parts.size() && parts[i].size() <= wire::kMaxInlineChangeBytes)
            packed->last = std::move(parts[i]);
        else
            packed->parts.push_back(std::make_shared<const wire::Bytes>(wire::encode(wire::Changes{parts[i]})));
    }
    return packed;
}

void FrameHistory::add(std::shared_ptr<const FrameChanges> frame) {
    UMBRIEL_ASSERT(frame->number == _newest + 1, "frames are numbered without gaps");
    _newest = frame->number;
    _bytes += frame->bytes;
    _frames.push_back(std::move(frame));
    while (_frames.size() > _frameLimit || (_bytes > _byteLimit && _frames.size() > 1)) forget(_frames.front()->number);
}

void FrameHistory::restart(std::uint64_t number) {
    _frames.clear();
    _bytes = 0;
    _newest = number;
}

std::optional<FrameHistory::Frames> FrameHistory::since(std::uint64_t frame) const {
    UMBRIEL_ASSERT(frame <= _newest, "no server is ahead of the client");
    const std::uint64_t missing = _newest - frame;
    if (missing > _frames.size()) return std::nullopt;
    return Frames(_frames.end() - static_cast<std::ptrdiff_t>(missing), _frames.end());
}

void FrameHistory::forget(std::uint64_t upTo) {
    while (!_frames.empty() && _frames.front()->number <= upTo) {
        _bytes -= _frames.front()->bytes;
        _frames.pop_front();
    }
}

}  // namespace umbriel::protocol
