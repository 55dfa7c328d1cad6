#include "common/wire/blob.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace umbriel::wire {

Hash128 hashOfBlob(const MultiStorage& data) {
    Hasher128 hasher;
    std::array<std::uint64_t, 2 * Chunk::kMaxBlocks> words{data.elementSize(), data.byteSize()};
    hasher.add(std::as_bytes(std::span(words).first(2)));
    for (std::size_t i = 0; i < data.chunkCount(); ++i) {
        std::size_t count = 0;
        for (std::size_t block = 0; block < data.blocksOfChunk(i); ++block) {
            const Hash128 hash = data.blockHash(i, block);
            words[count++] = hash.low;
            words[count++] = hash.high;
        }
        hasher.add(std::as_bytes(std::span(words).first(count)));
    }
    return hasher.finish();
}

const MultiStorage* BlobStore::find(const Hash128& hash) const {
    const auto found = _blobs.find(hash);
    return found == _blobs.end() ? nullptr : &found->second;
}

void BlobStore::put(Blob blob) {
    _blobs.insert_or_assign(blob.ref.hash, std::move(blob.data));
}

namespace {

bool possible(const BlobRef& ref) {
    return ref.elementSize > 0 && ref.elementSize <= MultiStorage::kChunkBytes && ref.bytes % ref.elementSize == 0;
}

}  // namespace

BlobAssembler::BlobAssembler(const BlobRef& ref, std::uint64_t maxBytes)
    : _ref(ref), _maxBytes(maxBytes), _data(possible(ref) ? ref.elementSize : 1, possible(ref) ? ref.bytes : 0) {}

Result<void> BlobAssembler::add(std::span<const std::byte> piece) {
    if (!possible(_ref)) return badInput(fmt::format("blob {}: its element size is impossible", toHex(_ref.hash)));
    if (_ref.bytes > _maxBytes)
        return badInput(
            fmt::format("blob {}: {} bytes are more than the limit of {}", toHex(_ref.hash), _ref.bytes, _maxBytes));
    if (piece.size() > _data.missing())
        return badInput(fmt::format("blob {}: more than its {} bytes came", toHex(_ref.hash), _ref.bytes));
    _data.add(piece);
    return {};
}

Result<Blob> BlobAssembler::finish() {
    UMBRIEL_ASSERT(complete(), "a blob is finished before all of it came");
    MultiStorage data = _data.take();
    if (!possible(_ref) || hashOfBlob(data) != _ref.hash)
        return badInput(fmt::format("blob {}: what came is something else", toHex(_ref.hash)));
    return Blob{_ref, std::move(data)};
}

}  // namespace umbriel::wire
