#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "common/base/hash.h"
#include "common/scene/multi_field.h"
#include "common/wire/bytes.h"

namespace umbriel::protocol {

// What one frame changes (or a whole scene), encoded once for all servers that need it.
struct FrameChanges {
    std::uint64_t number = 0;
    std::vector<std::shared_ptr<const wire::Bytes>> parts;  // Changes messages
    wire::Bytes last;                                       // follows them; small enough for the frame message
    std::map<Hash128, MultiStorage> blobs;                  // what the parts refer to
    std::uint64_t bytes = 0;                                // of parts and blobs
    std::uint64_t changeBytes = 0;                          // of parts and the last one
    std::uint64_t longestBlob = 0;
};

// parts: encodeChanges' parts.
std::shared_ptr<const FrameChanges> packChanges(std::uint64_t number, std::vector<wire::Bytes> parts,
                                                std::map<Hash128, MultiStorage> blobs);

// The changes of the last frames, for servers that are behind. Bounded: a server that is further behind than this needs
// a snapshot, so that no server, however slow, costs more memory than the limit.
class FrameHistory {
 public:
    using Frames = std::vector<std::shared_ptr<const FrameChanges>>;

    FrameHistory(std::uint64_t byteLimit, std::size_t frameLimit) : _byteLimit(byteLimit), _frameLimit(frameLimit) {}

    // Frames come in order, without gaps.
    void add(std::shared_ptr<const FrameChanges> frame);
    // The scene was replaced by this frame: what changed before does not matter any more.
    void restart(std::uint64_t number);
    // All that changed after that frame, oldest first; nothing when it is not known any more.
    std::optional<Frames> since(std::uint64_t frame) const;
    // No server needs the changes up to this frame.
    void forget(std::uint64_t upTo);
    std::uint64_t bytes() const { return _bytes; }
    std::size_t frames() const { return _frames.size(); }

 private:
    std::deque<std::shared_ptr<const FrameChanges>> _frames;
    std::uint64_t _newest = 0;
    std::uint64_t _bytes = 0;
    std::uint64_t _byteLimit;
    std::size_t _frameLimit;
};

}  // namespace umbriel::protocol
