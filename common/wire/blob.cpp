#include "common/wire/blob.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace umbriel::wire {

namespace {

void addElementSize(Hasher128& hasher, std::uint32_t elementSize) {
    std::array<std::byte, 4> size;
    for (std::size_t i = 0; i < size.size(); ++i) size[i] = static_cast<std::byte>(elementSize >> (8 * i));
    hasher.add(size);
}

}  // namespace

Hash128 hashOfBlob(const MultiStorage& data) {
    Hasher128 hasher;
    addElementSize(hasher, data.elementSize());
    for (std::size_t i = 0; i < data.chunkCount(); ++i) hasher.add(data.chunk(i));
    return hasher.finish();
}

Hash128 BlobHashes::hashOf(ContainerId id, std::uint32_t field, const MultiStorage& data) {
    auto& fields = _entries[id];
    const auto found = fields.find(field);
    if (found != fields.end() && found->second.data.sharesEverything(data)) return found->second.hash;
    const Hash128 hash = hashOfBlob(data);
    fields.insert_or_assign(field, Entry{data, hash});
    return hash;
}

void BlobHashes::forget(const ChangeList& changes) {
    for (const ContainerChange& change : changes.changed) {
        const auto found = _entries.find(change.id);
        if (found == _entries.end()) continue;
        for (const MultiChange& multi : change.multis) found->second.erase(multi.field);
    }
    for (const ContainerId id : changes.destroyed) _entries.erase(id);
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
    : _ref(ref), _maxBytes(maxBytes), _data(possible(ref) ? ref.elementSize : 1), _hasher(std::make_unique<Hasher128>()) {
    addElementSize(*_hasher, ref.elementSize);
}

Result<void> BlobAssembler::add(std::span<const std::byte> piece) {
    if (!possible(_ref)) return badInput(fmt::format("blob {}: its element size is impossible", toHex(_ref.hash)));
    if (_ref.bytes > _maxBytes)
        return badInput(
            fmt::format("blob {}: {} bytes are more than the limit of {}", toHex(_ref.hash), _ref.bytes, _maxBytes));
    if (piece.size() > _ref.bytes - _received)
        return badInput(fmt::format("blob {}: more than its {} bytes came", toHex(_ref.hash), _ref.bytes));
    _received += piece.size();
    _hasher->add(piece);
    const std::size_t elementSize = _ref.elementSize;
    const auto append = [&](std::span<const std::byte> elements) {
        const std::size_t size = _data.size();
        _data.resize(size + elements.size() / elementSize);
        _data.write(size, elements);
    };
    if (!_partial.empty()) {
        const std::size_t missing = std::min(elementSize - _partial.size(), piece.size());
        _partial.insert(_partial.end(), piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(missing));
        piece = piece.subspan(missing);
        if (_partial.size() < elementSize) return {};
        append(_partial);
        _partial.clear();
    }
    const std::size_t whole = piece.size() - piece.size() % elementSize;
    append(piece.first(whole));
    _partial.assign(piece.begin() + static_cast<std::ptrdiff_t>(whole), piece.end());
    return {};
}

Result<Blob> BlobAssembler::finish() {
    UMBRIEL_ASSERT(complete(), "a blob is finished before all of it came");
    if (!possible(_ref) || _hasher->finish() != _ref.hash)
        return badInput(fmt::format("blob {}: what came is something else", toHex(_ref.hash)));
    return Blob{_ref, std::move(_data)};
}

}  // namespace umbriel::wire
