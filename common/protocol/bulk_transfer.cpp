#include "common/protocol/bulk_transfer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace umbriel::protocol {
namespace {

constexpr std::size_t kQueueTarget = std::size_t{1} << 20;
// Tiles of so many frames may be under way.
constexpr std::uint64_t kFramesKept = 2;
constexpr std::size_t kChunksPerMessage = wire::kChunkBytes / MultiStorage::kChunkBytes;

}  // namespace

void BulkSender::addBlob(const Hash128& hash, MultiStorage content) {
    _items.push_back({Blob{hash, std::make_shared<const MultiStorage>(std::move(content))}});
}

void BulkSender::addTile(std::uint64_t frame, TilePixels tile) {
    // A client that reads slowly has given up older frames: what it would throw away need not wait here.
    const auto givenUp = [frame](const Item& item) {
        const Tile* old = std::get_if<Tile>(&item.what);
        return old && old->frame + kFramesKept <= frame && old->layer == 0 && item.offset == 0;
    };
    std::erase_if(_items, givenUp);
    if (!tile.layers.empty()) _items.push_back({Tile{frame, std::move(tile), 0}});
}

void BulkSender::fill(Link& link) {
    while (!_items.empty() && link.isOpen() && link.output().size() < kQueueTarget) {
        Item& item = _items.front();
        const bool more = std::visit([&](auto& what) { return sendPart(link, what, item.offset); }, item.what);
        if (!more) _items.pop_front();
    }
}

bool BulkSender::sendPart(Link& link, Blob& blob, std::uint64_t& offset) {
    const MultiStorage& content = *blob.content;
    std::array<std::span<const std::byte>, kChunksPerMessage> pieces;
    std::size_t count = 0;
    const std::size_t first = static_cast<std::size_t>(offset) / (content.elementsPerChunk() * content.elementSize());
    std::uint64_t end = offset;
    for (std::size_t i = first; i < content.chunkCount() && count < pieces.size(); ++i) {
        pieces[count++] = content.chunk(i);
        end += content.chunk(i).size();
    }
    const std::uint64_t total = content.byteSize();
    const wire::Bytes head = wire::encode(wire::BlobData{blob.hash, total, offset, {}});
    link.sendPieces(wire::MessageType::BlobData, head, blob.content, std::span(pieces).first(count));
    offset = end;
    return offset < total;
}

bool BulkSender::sendPart(Link& link, Tile& tile, std::uint64_t& offset) {
    const TileLayer& layer = tile.pixels.layers[tile.layer];
    const std::uint64_t total = layer.pixels.size();
    wire::TileData data;
    data.frame = tile.frame;
    data.tile = tile.pixels.tile.tile;
    data.layerIndex = static_cast<std::uint32_t>(tile.layer);
    data.layerCount = static_cast<std::uint32_t>(tile.pixels.layers.size());
    data.layer = layer.layer;
    data.name = layer.name;
    data.channels = layer.channels;
    data.components = layer.components;
    data.total = total;
    data.offset = offset;
    data.bytes = std::span(layer.pixels)
                     .subspan(static_cast<std::size_t>(offset),
                              static_cast<std::size_t>(std::min<std::uint64_t>(wire::kChunkBytes, total - offset)));
    link.send(data);
    offset += data.bytes.size();
    if (offset < total) return true;
    offset = 0;
    return ++tile.layer < tile.pixels.layers.size();
}

bool BlobReceiver::expect(const wire::BlobRef& wanted) {
    return _partial.emplace(wanted.hash, Partial{wire::BlobAssembler(wanted, wire::kMaxBlobBytes), wanted.bytes}).second;
}

Result<std::optional<wire::Blob>> BlobReceiver::part(const wire::BlobData& data) {
    const auto found = _partial.find(data.hash);
    if (found == _partial.end()) return failure(fmt::format("blob {} was not asked for", toHex(data.hash)));
    Partial& partial = found->second;
    if (data.total != partial.bytes)
        return failure(fmt::format("blob {} has {} bytes, {} were expected", toHex(data.hash), data.total, partial.bytes));
    if (data.offset != partial.received)
        return failure(fmt::format("blob {} continues at byte {}, not at {}", toHex(data.hash), data.offset, partial.received));
    if (_begun && *_begun != data.hash)
        return failure(fmt::format("blob {} begins before blob {} has ended", toHex(data.hash), toHex(*_begun)));
    _begun = data.hash;
    if (const auto added = partial.assembler.add(data.bytes); !added) return added.error();
    return received(found, data.bytes.size());
}

Result<std::optional<wire::Blob>> BlobReceiver::more(std::span<const std::byte> bytes) {
    if (!_begun) return failure("a blob goes on after its last byte");
    const auto found = _partial.find(*_begun);
    if (const auto added = found->second.assembler.add(bytes); !added) return added.error();
    return received(found, bytes.size());
}

std::size_t BlobReceiver::room(std::span<std::span<std::byte>> places) {
    return _begun ? _partial.find(*_begun)->second.assembler.room(places) : 0;
}

Result<std::optional<wire::Blob>> BlobReceiver::filled(std::size_t count) {
    UMBRIEL_ASSERT(_begun, "only room that was given can be filled");
    const auto found = _partial.find(*_begun);
    found->second.assembler.filled(count);
    return received(found, count);
}

Result<std::optional<wire::Blob>> BlobReceiver::received(Partials::iterator found, std::size_t count) {
    Partial& partial = found->second;
    partial.received += count;
    if (!partial.assembler.complete()) return std::optional<wire::Blob>();
    auto blob = partial.assembler.finish();
    _partial.erase(found);
    _begun.reset();
    if (!blob) return blob.error();
    return std::optional<wire::Blob>(std::move(*blob));
}

void TileReceiver::expect(std::uint64_t frame, const std::vector<TileAssignment>& tiles) {
    _frame = frame;
    _tiles.clear();
    for (const TileAssignment& tile : tiles) {
        _tiles.emplace_back();
        _tiles.back().pixels.tile = tile;
    }
}

Result<bool> TileReceiver::part(const wire::TileData& data) {
    const auto found = std::find_if(_tiles.begin(), _tiles.end(), [&](const Partial& partial) {
        return partial.pixels.tile.tile == data.tile && !partial.complete;
    });
    if (data.frame != _frame || found == _tiles.end())
        return failure(fmt::format("tile {} of frame {} was not asked for", data.tile, data.frame));
    const PixelRect rect = found->pixels.tile.pixels;
    auto& layers = found->pixels.layers;
    if (data.offset == 0) {
        const bool inOrder = data.layerIndex == layers.size() && (layers.empty() || data.layerCount == found->layerCount) &&
                             (layers.empty() || layers.back().pixels.size() == found->total);
        if (!inOrder) return failure(fmt::format("tile {}: layer {} is out of order", data.tile, data.layerIndex));
        if (data.total != static_cast<std::uint64_t>(rect.area()) * data.channels * bytesOf(data.components))
            return failure(fmt::format("tile {}: layer '{}' has {} bytes, not {}x{} pixels of {} channels of {}",
                                       data.tile, data.name, data.total, rect.width, rect.height, data.channels,
                                       bytesOf(data.components)));
        layers.push_back({data.layer, data.name, data.channels, data.components, {}});
        found->layerCount = data.layerCount;
        found->total = data.total;
        layers.back().pixels.reserve(static_cast<std::size_t>(data.total));  // a tile that we assigned
    } else if (layers.empty() || data.layerIndex + 1 != layers.size() || data.offset != layers.back().pixels.size() ||
               data.total != found->total) {
        return failure(fmt::format("tile {}: a part of layer {} is out of order", data.tile, data.layerIndex));
    }
    auto& pixels = layers.back().pixels;
    pixels.insert(pixels.end(), data.bytes.begin(), data.bytes.end());
    found->complete = layers.size() == found->layerCount && pixels.size() == found->total;
    return std::all_of(_tiles.begin(), _tiles.end(), [](const Partial& partial) { return partial.complete; });
}

std::vector<TilePixels> TileReceiver::take() {
    std::vector<TilePixels> tiles;
    for (Partial& partial : _tiles) tiles.push_back(std::move(partial.pixels));
    _tiles.clear();
    return tiles;
}

}  // namespace umbriel::protocol
