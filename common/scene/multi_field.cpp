#include "common/scene/multi_field.h"

#include <algorithm>

namespace umbriel {

MultiStorage::MultiStorage(std::uint32_t elementSize)
    : _elementSize(elementSize), _elementsPerChunk(elementSize == 0 ? 0 : kChunkBytes / elementSize) {
    UMBRIEL_ASSERT(elementSize > 0 && elementSize <= kChunkBytes, "elements must fit into a chunk");
}

std::span<const std::byte> MultiStorage::chunk(std::size_t index) const {
    UMBRIEL_ASSERT(index < _chunks.size(), "chunk index out of range");
    return _chunks[index]->bytes();
}

bool MultiStorage::sharesChunk(std::size_t index, const MultiStorage& other) const {
    return index < _chunks.size() && index < other._chunks.size() && _chunks[index] == other._chunks[index];
}

void MultiStorage::read(std::size_t first, std::span<std::byte> bytes) const {
    UMBRIEL_ASSERT(bytes.size() % _elementSize == 0, "whole elements only");
    const std::size_t count = bytes.size() / _elementSize;
    UMBRIEL_ASSERT(first <= _size && count <= _size - first, "elements out of range");
    if (bytes.empty()) return;
    const auto view = viewBytes(first * _elementSize, bytes);
    if (view.data() != bytes.data()) std::memcpy(bytes.data(), view.data(), view.size());
}

std::span<const std::byte> MultiStorage::viewBytes(std::size_t offset, std::span<std::byte> scratch) const {
    UMBRIEL_ASSERT(offset <= byteSize() && scratch.size() <= byteSize() - offset, "bytes out of range");
    if (scratch.empty()) return {};
    const std::size_t chunkBytes = std::size_t{_elementsPerChunk} * _elementSize;
    std::size_t index = offset / chunkBytes;
    std::size_t inChunk = offset % chunkBytes;
    const auto bytes = _chunks[index]->bytes();
    if (scratch.size() <= bytes.size() - inChunk) return bytes.subspan(inChunk, scratch.size());
    for (std::size_t done = 0; done < scratch.size(); ++index, inChunk = 0) {
        const auto source = _chunks[index]->bytes();
        const std::size_t count = std::min(source.size() - inChunk, scratch.size() - done);
        std::memcpy(scratch.data() + done, source.data() + inChunk, count);
        done += count;
    }
    return scratch;
}

bool MultiStorage::holds(std::size_t first, std::span<const std::byte> bytes) const {
    UMBRIEL_ASSERT(bytes.size() % _elementSize == 0, "whole elements only");
    if (first > _size || bytes.size() / _elementSize > _size - first) return false;
    std::size_t index = first / _elementsPerChunk;
    std::size_t inChunk = first % _elementsPerChunk * _elementSize;
    for (std::size_t done = 0; done < bytes.size(); ++index, inChunk = 0) {
        const auto chunk = _chunks[index]->bytes();
        const std::size_t count = std::min(chunk.size() - inChunk, bytes.size() - done);
        if (std::memcmp(bytes.data() + done, chunk.data() + inChunk, count) != 0) return false;
        done += count;
    }
    return true;
}

void MultiStorage::resize(std::size_t size) {
    if (size == _size) return;
    const std::size_t chunksBefore = _chunks.size();
    const std::size_t chunks = size / _elementsPerChunk + (size % _elementsPerChunk != 0 ? 1 : 0);
    _size = size;
    _chunks.resize(chunks);
    // The chunk that was the last one, or now is: the only existing one whose length can have changed.
    if (const std::size_t kept = std::min(chunksBefore, chunks); kept > 0)
        _chunks[kept - 1].resize(chunkElements(kept - 1) * _elementSize);
    if (chunks <= chunksBefore) return;
    ChunkHandle zeros;
    for (std::size_t i = chunksBefore; i < chunks; ++i) {
        const std::size_t bytes = chunkElements(i) * _elementSize;
        if (i + 1 == chunks)
            _chunks[i] = ChunkHandle::zeros(bytes);
        else {
            if (i == chunksBefore) zeros = ChunkHandle::zeros(bytes);
            _chunks[i] = zeros;
        }
    }
}

void MultiStorage::write(std::size_t first, std::span<const std::byte> bytes) {
    UMBRIEL_ASSERT(bytes.size() % _elementSize == 0, "whole elements only");
    const std::size_t count = bytes.size() / _elementSize;
    UMBRIEL_ASSERT(first <= _size && count <= _size - first, "elements out of range");
    std::size_t index = first / _elementsPerChunk;
    std::size_t inChunk = first % _elementsPerChunk * _elementSize;
    ChunkSource source(bytes.size());
    for (std::size_t done = 0; done < bytes.size(); ++index, inChunk = 0) {
        const std::size_t part = std::min(_chunks[index]->bytes().size() - inChunk, bytes.size() - done);
        _chunks[index].write(inChunk, bytes.subspan(done, part), source);
        done += part;
    }
}

void MultiStorage::copyFrom(const MultiStorage& source, std::size_t first, std::size_t count) {
    UMBRIEL_ASSERT(source._elementSize == _elementSize, "elements of one size only");
    UMBRIEL_ASSERT(first <= _size && count <= _size - first, "elements out of range");
    UMBRIEL_ASSERT(first <= source._size && count <= source._size - first, "elements out of the source's range");
    ChunkSource memory(count * _elementSize);
    for (std::size_t done = 0; done < count;) {
        const std::size_t index = (first + done) / _elementsPerChunk;
        const std::size_t inChunk = (first + done) % _elementsPerChunk;
        const std::size_t part = std::min(chunkElements(index) - inChunk, count - done);
        if (part == chunkElements(index) && _chunks[index]->bytes().size() == source._chunks[index]->bytes().size())
            _chunks[index] = source._chunks[index];
        else if (_chunks[index] != source._chunks[index])
            _chunks[index].write(inChunk * _elementSize,
                                 source.chunk(index).subspan(inChunk * _elementSize, part * _elementSize), memory);
        done += part;
    }
}

bool MultiStorage::equals(const MultiStorage& other) const {
    if (_elementSize != other._elementSize || _size != other._size) return false;
    for (std::size_t i = 0; i < _chunks.size(); ++i)
        if (_chunks[i] != other._chunks[i] && !std::ranges::equal(_chunks[i]->bytes(), other._chunks[i]->bytes()))
            return false;
    return true;
}

std::size_t MultiStorage::chunkElements(std::size_t chunk) const {
    return std::min<std::size_t>(_elementsPerChunk, _size - chunk * _elementsPerChunk);
}

MultiBuilder::MultiBuilder(std::uint32_t elementSize, std::uint64_t totalBytes)
    : _data(elementSize), _missing(totalBytes), _unplanned(totalBytes), _source(totalBytes) {
    UMBRIEL_ASSERT(totalBytes % elementSize == 0, "whole elements only");
}

std::span<std::byte> MultiBuilder::roomIn(std::size_t chunk) {
    if (chunk == _data._chunks.size()) {
        const std::size_t full = std::size_t{_data._elementsPerChunk} * _data._elementSize;
        const auto bytes = static_cast<std::size_t>(std::min<std::uint64_t>(full, _unplanned));
        _data._chunks.push_back(_source.take(bytes));
        _data._size += bytes / _data._elementSize;
        _unplanned -= bytes;
    }
    return _data._chunks[chunk].fill().subspan(chunk == _chunk ? _used : 0);
}

std::size_t MultiBuilder::room(std::span<std::span<std::byte>> places) {
    std::size_t count = 0;
    for (std::uint64_t offered = 0; count < places.size() && offered < _missing; ++count) {
        places[count] = roomIn(_chunk + count);
        offered += places[count].size();
    }
    return count;
}

void MultiBuilder::filled(std::size_t count) {
    UMBRIEL_ASSERT(count <= _missing - _unplanned, "more bytes than there was room for");
    _missing -= count;
    while (count > 0) {
        const ChunkHandle& chunk = _data._chunks[_chunk];
        const std::size_t here = std::min(count, chunk->bytes().size() - _used);
        count -= here;
        _used += here;
        if (_used < chunk->bytes().size()) return;
        // Now it is in the processor's cache.
        for (std::size_t block = 0; block < chunk->blocks(); ++block) chunk->blockHash(block);
        ++_chunk;
        _used = 0;
    }
}

void MultiBuilder::add(std::span<const std::byte> bytes) {
    UMBRIEL_ASSERT(bytes.size() <= _missing, "more bytes than there is room for");
    while (!bytes.empty()) {
        const auto to = roomIn(_chunk);
        const std::size_t count = std::min(to.size(), bytes.size());
        std::memcpy(to.data(), bytes.data(), count);
        filled(count);
        bytes = bytes.subspan(count);
    }
}

MultiStorage MultiBuilder::take() {
    UMBRIEL_ASSERT(_missing == 0, "a content is taken before all of it came");
    return std::move(_data);
}

}  // namespace umbriel
