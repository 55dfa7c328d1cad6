#include "common/scene/multi_field.h"

#include <algorithm>

namespace umbriel {

MultiStorage::MultiStorage(std::uint32_t elementSize)
    : _elementSize(elementSize), _elementsPerChunk(elementSize == 0 ? 0 : kChunkBytes / elementSize) {
    UMBRIEL_ASSERT(elementSize > 0 && elementSize <= kChunkBytes, "elements must fit into a chunk");
}

std::span<const std::byte> MultiStorage::chunk(std::size_t index) const {
    UMBRIEL_ASSERT(index < _chunks.size(), "chunk index out of range");
    return _chunks[index]->bytes;
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
    const auto& bytes = _chunks[index]->bytes;
    if (scratch.size() <= bytes.size() - inChunk) return std::span(bytes).subspan(inChunk, scratch.size());
    for (std::size_t done = 0; done < scratch.size(); ++index, inChunk = 0) {
        const auto& source = _chunks[index]->bytes;
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
        const auto& chunk = _chunks[index]->bytes;
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
        resizeChunk(kept - 1, chunkElements(kept - 1) * _elementSize);
    if (chunks <= chunksBefore) return;
    ChunkHandle zeros;
    for (std::size_t i = chunksBefore; i < chunks; ++i) {
        const std::size_t bytes = chunkElements(i) * _elementSize;
        if (i + 1 == chunks)
            _chunks[i] = ChunkHandle(std::vector<std::byte>(bytes));
        else {
            if (i == chunksBefore) zeros = ChunkHandle(std::vector<std::byte>(bytes));
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
    for (std::size_t done = 0; done < bytes.size(); ++index, inChunk = 0) {
        const std::size_t part = std::min(_chunks[index]->bytes.size() - inChunk, bytes.size() - done);
        writeBytes(index, inChunk, bytes.subspan(done, part));
        done += part;
    }
}

void MultiStorage::copyFrom(const MultiStorage& source, std::size_t first, std::size_t count) {
    UMBRIEL_ASSERT(source._elementSize == _elementSize, "elements of one size only");
    UMBRIEL_ASSERT(first <= _size && count <= _size - first, "elements out of range");
    UMBRIEL_ASSERT(first <= source._size && count <= source._size - first, "elements out of the source's range");
    for (std::size_t done = 0; done < count;) {
        const std::size_t index = (first + done) / _elementsPerChunk;
        const std::size_t inChunk = (first + done) % _elementsPerChunk;
        const std::size_t part = std::min(chunkElements(index) - inChunk, count - done);
        if (part == chunkElements(index) && _chunks[index]->bytes.size() == source._chunks[index]->bytes.size())
            _chunks[index] = source._chunks[index];
        else if (_chunks[index] != source._chunks[index])
            writeBytes(index, inChunk * _elementSize,
                       source.chunk(index).subspan(inChunk * _elementSize, part * _elementSize));
        done += part;
    }
}

bool MultiStorage::equals(const MultiStorage& other) const {
    if (_elementSize != other._elementSize || _size != other._size) return false;
    for (std::size_t i = 0; i < _chunks.size(); ++i)
        if (_chunks[i] != other._chunks[i] && _chunks[i]->bytes != other._chunks[i]->bytes) return false;
    return true;
}

std::size_t MultiStorage::chunkElements(std::size_t chunk) const {
    return std::min<std::size_t>(_elementsPerChunk, _size - chunk * _elementsPerChunk);
}

void MultiStorage::writeBytes(std::size_t chunk, std::size_t offset, std::span<const std::byte> bytes) {
    ChunkHandle& handle = _chunks[chunk];
    if (!handle.onlyOwner()) {
        if (bytes.size() == handle->bytes.size()) {
            handle = ChunkHandle(std::vector<std::byte>(bytes.begin(), bytes.end()));
            return;
        }
        handle = ChunkHandle(std::vector<std::byte>(handle->bytes));
    }
    std::memcpy(handle->bytes.data() + offset, bytes.data(), bytes.size());
}

void MultiStorage::resizeChunk(std::size_t chunk, std::size_t bytes) {
    ChunkHandle& handle = _chunks[chunk];
    if (handle->bytes.size() == bytes) return;
    const std::size_t kept = std::min(bytes, handle->bytes.size());
    if (!handle.onlyOwner()) {
        std::vector<std::byte> copy(bytes);
        std::memcpy(copy.data(), handle->bytes.data(), kept);
        handle = ChunkHandle(std::move(copy));
        return;
    }
    // Elements appended one by one cost amortised constant time; doubling past the chunk's end would only waste memory.
    auto& own = handle->bytes;
    if (bytes > own.capacity()) own.reserve(std::max(bytes, std::min(own.capacity() * 2, kChunkBytes)));
    own.resize(bytes);
}

}  // namespace umbriel
