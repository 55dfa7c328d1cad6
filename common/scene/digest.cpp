#include "common/scene/digest.h"

#include <algorithm>
#include <array>

#include "common/base/hash.h"
#include "common/scene/field_values.h"

namespace umbriel {

namespace {

// What existence itself hashes to is named by a field that no container has.
constexpr std::uint64_t kExistence = kMaxFields;

// The place is hashed, not only added to the value's hash: equal values in different places count differently.
std::uint64_t hashOf(ContainerId id, std::uint64_t field, std::uint64_t block, std::span<const std::byte> value) {
    const std::array<std::uint64_t, 3> place = {id.value, field, block};
    return hash64(value, hash64(std::as_bytes(std::span(place))));
}

// Of a block of a multi field the hash counts, which is kept with its chunk, mixed with its place as XXH3 mixes: by a
// folded product of 128 bits. place: hash of the container and the field; block: counts through all chunks.
std::uint64_t mixed(std::uint64_t place, std::uint64_t block, const Hash128& value) {
    __extension__ using Product = unsigned __int128;
    constexpr std::uint64_t kOdd = 0x9e3779b97f4a7c15;  // 2^64 / golden ratio
    const Product product = static_cast<Product>(value.low ^ place) * (value.high ^ (place + (block + 1) * kOdd));
    return static_cast<std::uint64_t>(product) ^ static_cast<std::uint64_t>(product >> 64);
}

std::size_t blockCount(const MultiStorage& storage) {
    const std::size_t chunks = storage.chunkCount();
    return chunks == 0 ? 0 : (chunks - 1) * storage.blocksPerChunk() + storage.blocksOfChunk(chunks - 1);
}

// The block that an element's first, or last, byte lies in.
std::size_t blockOf(const MultiStorage& storage, std::size_t element, bool lastByte) {
    const std::size_t inChunk = element % storage.elementsPerChunk() * storage.elementSize();
    return element / storage.elementsPerChunk() * storage.blocksPerChunk() +
           (inChunk + (lastByte ? storage.elementSize() - 1 : 0)) / Chunk::kBlockBytes;
}

std::uint64_t sumOf(const std::vector<std::uint64_t>& values) {
    std::uint64_t sum = 0;
    for (const std::uint64_t value : values) sum += value;
    return sum;
}

// The position of a multi field among its type's multi fields.
std::size_t multiOrdinal(const TypeDescriptor& type, std::uint32_t field) {
    return static_cast<std::size_t>(
        std::count_if(type.fields.begin(), type.fields.begin() + field,
                      [](const FieldDescriptor& descriptor) { return descriptor.isMulti; }));
}

// Rehashes what the ranges touch, and the last block: when a field shrinks, that one loses bytes though none is
// touched.
void rehash(std::vector<std::uint64_t>& blocks, ContainerId id, std::uint32_t field, const MultiStorage& storage,
            const IndexRanges& touched) {
    blocks.resize(blockCount(storage));
    if (blocks.empty()) return;
    const std::uint64_t place = hashOf(id, field, 0, {});
    const std::size_t perChunk = storage.blocksPerChunk();
    const auto rehash = [&](std::size_t begin, std::size_t end) {
        for (std::size_t chunk = begin / perChunk, inChunk = begin % perChunk; begin < end; ++chunk, inChunk = 0)
            for (; inChunk < perChunk && begin < end; ++inChunk, ++begin)
                blocks[begin] = mixed(place, begin, storage.blockHash(chunk, inChunk));
    };
    std::size_t done = 0;  // blocks below are up to date
    for (const IndexRange& range : touched.ranges()) {
        if (range.first >= storage.size()) break;
        const std::size_t last = std::min(range.first + range.count, storage.size());
        const std::size_t end = blockOf(storage, last - 1, true) + 1;
        rehash(std::max(blockOf(storage, range.first, false), done), end);
        done = std::max(done, end);
    }
    if (done < blocks.size()) rehash(blocks.size() - 1, blocks.size());
}

}  // namespace

void StateDigest::update(const ChangeList& changes, const Aspect& aspect) {
    for (const ContainerCreation& creation : changes.created) {
        remove(creation.id);
        if (const Container* container = aspect.find(creation.id); container && container->type().shipped)
            add(creation.id, *container);
    }
    for (const ContainerChange& change : changes.changed) {
        const auto found = _entries.find(change.id);
        const Container* container = aspect.find(change.id);
        if (found == _entries.end() || !container) continue;
        Entry& entry = found->second;
        const TypeDescriptor& type = container->type();
        for (std::uint32_t i = 0; i < type.fields.size(); ++i)
            if (((change.fields >> i) & 1) && !type.fields[i].isMulti)
                setField(entry, i, hashOf(change.id, i, 0, bytesOfSingle(type.fields[i], *container)));
        for (const MultiChange& multi : change.multis) {
            auto& blocks = entry.blocks[multiOrdinal(type, multi.field)];
            rehash(blocks, change.id, multi.field, type.fields[multi.field].multi(*container), multi.touched);
            setField(entry, multi.field, sumOf(blocks));
        }
    }
    for (const ContainerId id : changes.destroyed) remove(id);
}

std::uint64_t StateDigest::ofContainer(ContainerId id) const {
    const auto found = _entries.find(id);
    return found == _entries.end() ? 0 : found->second.sum;
}

std::uint64_t StateDigest::ofField(ContainerId id, std::uint32_t field) const {
    const auto found = _entries.find(id);
    return found == _entries.end() || field >= found->second.fields.size() ? 0 : found->second.fields[field];
}

std::vector<std::pair<ContainerId, std::uint64_t>> StateDigest::containers(ContainerId after, std::size_t count) const {
    std::vector<std::pair<ContainerId, std::uint64_t>> containers;
    containers.reserve(_entries.size());
    for (const auto& [id, entry] : _entries)
        if (after < id) containers.emplace_back(id, entry.sum);
    if (count < containers.size()) {
        std::nth_element(containers.begin(), containers.begin() + static_cast<std::ptrdiff_t>(count), containers.end());
        containers.resize(count);
    }
    std::sort(containers.begin(), containers.end());
    return containers;
}

void StateDigest::add(ContainerId id, const Container& container) {
    const TypeDescriptor& type = container.type();
    Entry& entry = _entries[id];
    entry.sum = hashOf(id, kExistence, 0, std::as_bytes(std::span(type.name)));
    _total += entry.sum;
    entry.fields.resize(type.fields.size());
    for (std::uint32_t i = 0; i < type.fields.size(); ++i) {
        if (!type.fields[i].isMulti) {
            setField(entry, i, hashOf(id, i, 0, bytesOfSingle(type.fields[i], container)));
            continue;
        }
        const MultiStorage& storage = type.fields[i].multi(container);
        IndexRanges everything;
        everything.add(0, storage.size());
        rehash(entry.blocks.emplace_back(), id, i, storage, everything);
        setField(entry, i, sumOf(entry.blocks.back()));
    }
}

void StateDigest::remove(ContainerId id) {
    const auto found = _entries.find(id);
    if (found == _entries.end()) return;
    _total -= found->second.sum;
    _entries.erase(found);
}

void StateDigest::setField(Entry& entry, std::uint32_t field, std::uint64_t sum) {
    const std::uint64_t difference = sum - entry.fields[field];
    entry.fields[field] = sum;
    entry.sum += difference;
    _total += difference;
}

}  // namespace umbriel
