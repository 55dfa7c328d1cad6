#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "common/base/hash.h"
#include "common/base/result.h"
#include "common/protocol/link.h"
#include "common/scene/multi_field.h"
#include "common/wall/tile_pixels.h"
#include "common/wire/blob.h"
#include "common/wire/messages.h"

namespace umbriel::protocol {

// Sends blobs and tiles over a bulk link in chunks, producing the next ones only when the last were written: however much
// waits here, the link's queue holds little.
class BulkSender {
 public:
    // The content shares its chunks with whoever gave it; they are written from where they are.
    void addBlob(const Hash128& hash, MultiStorage content);
    // Tiles of frames two and more before this one that have not begun are dropped.
    void addTile(std::uint64_t frame, TilePixels tile);

    // Fills the link's queue up to about a megabyte.
    void fill(Link& link);
    bool empty() const { return _items.empty(); }
    std::size_t size() const { return _items.size(); }

 private:
    struct Blob {
        Hash128 hash;
        std::shared_ptr<const MultiStorage> content;  // until the last of it is written
    };
    struct Tile {
        std::uint64_t frame;
        TilePixels pixels;
        std::size_t layer;
    };
    struct Item {
        std::variant<Blob, Tile> what;
        std::uint64_t offset = 0;
    };
    // False when the item is finished.
    bool sendPart(Link& link, Blob& blob, std::uint64_t& offset);
    bool sendPart(Link& link, Tile& tile, std::uint64_t& offset);

    std::deque<Item> _items;
};

// Puts blobs together that were asked for. Memory grows with what has arrived, never with what a peer announces; the
// content is checked against its hash.
class BlobReceiver {
 public:
    // False when it is expected already.
    bool expect(const wire::BlobRef& wanted);
    // A blob when this part completes it. An error when it was not asked for, is out of order, or is not what its hash
    // says.
    Result<std::optional<wire::Blob>> part(const wire::BlobData& data);
    // More bytes of the part before; likewise.
    Result<std::optional<wire::Blob>> more(std::span<const std::byte> bytes);
    // Where those bytes belong, so that they need not lie elsewhere before. Returns how many places were set.
    std::size_t room(std::span<std::span<std::byte>> places);
    // As more(), of so many bytes that were written there.
    Result<std::optional<wire::Blob>> filled(std::size_t count);

 private:
    struct Partial {
        wire::BlobAssembler assembler;
        std::uint64_t bytes;
        std::uint64_t received = 0;
    };
    using Partials = std::map<Hash128, Partial>;
    Result<std::optional<wire::Blob>> received(Partials::iterator partial, std::size_t count);

    Partials _partial;
    std::optional<Hash128> _begun;  // one after the other: each that has begun takes memory ahead of what has come
};

// Puts the tiles of one frame together.
class TileReceiver {
 public:
    // Whose layers will come. Anything else is refused.
    void expect(std::uint64_t frame, const std::vector<TileAssignment>& tiles);
    // True when the frame's last tile is complete.
    Result<bool> part(const wire::TileData& data);
    std::vector<TilePixels> take();

 private:
    struct Partial {
        TilePixels pixels;
        std::uint32_t layerCount = 0;
        std::uint64_t total = 0;  // of the layer being received
        bool complete = false;
    };
    std::uint64_t _frame = 0;
    std::vector<Partial> _tiles;
};

}  // namespace umbriel::protocol
