// Any bytes, as a part of a change list: refused with a reason, or sound edits within the memory that was sent.
// Mutations know the format: mostly one number, entry, field or range changes, and everything around it stays readable.

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "common/base/assert.h"
#include "common/scene/digest.h"
#include "common/scene/print.h"
#include "common/wire/change_codec.h"
#include "tests/fuzz/change_parts.h"
#include "tests/support/random_scene.h"

namespace umbriel::wire {
namespace {

// Finds any blob a part may name: the fuzzer cannot guess hashes.
struct AnyBlob : BlobSource {
    AnyBlob() : words(4), points(12) {
        words.resize(5000);
        points.resize(5000);
    }
    const MultiStorage* find(const Hash128& hash) const override { return hash.low % 2 == 0 ? &words : &points; }
    MultiStorage words;
    MultiStorage points;
};

const TypeRegistry& allTypes() {
    static const TypeRegistry types = [] {
        TypeRegistry all;
        registerCoreTypes(all);
        all.add<test::EveryKind>();
        return all;
    }();
    return types;
}

void decode(std::span<const std::byte> part) {
    const TypeRegistry& types = allTypes();
    IdSource ids;
    Aspect aspect(types, ids);
    aspect.create<Node>("there already");
    aspect.create<test::EveryKind>();
    aspect.commit();
    static const AnyBlob blobs;
    (void)blobsReferenced(part);
    const auto applied = applyChanges(part, aspect, blobs);
    UMBRIEL_ASSERT(applied || !applied.error().message.empty(), "a refusal without a reason");
    const ChangeList changes = aspect.commit();
    StateDigest digest;
    digest.update(changes, aspect);
    for (const ContainerId id : aspect.ids())
        UMBRIEL_ASSERT(!describe(*aspect.find(id)).empty(), "a container that cannot be printed");
    // What was taken can be passed on, and arrives.
    IdSource otherIds;
    Aspect other(types, otherIds);
    BlobStore store;
    EncodedChanges snapshot = encodeChanges(aspect.snapshot(), aspect);
    for (Blob& blob : snapshot.blobs) store.put(std::move(blob));
    for (const Bytes& encoded : snapshot.parts)
        UMBRIEL_ASSERT(applyChanges(encoded, other, store).has_value(), "our own snapshot is refused");
    UMBRIEL_ASSERT(other.equals(aspect), "a snapshot loses something");
}

using fuzz::ChangePart;
using test::Random;

// Near what it was, or an extreme: what off-by-one errors and overflows need.
std::uint64_t otherNumber(std::uint64_t value, Random& random) {
    switch (random.below(5)) {
        case 0:
            return value + 1;
        case 1:
            return value - 1;
        case 2:
            return random.below(16);
        case 3:
            return value ^ std::uint64_t{1} << random.below(64);
        default:
            return ~std::uint64_t{0} >> random.below(64);
    }
}

template <class T>
T& anyOf(std::vector<T>& items, Random& random) {
    return items[random.below(items.size())];
}

// The one mutation that libFuzzer itself does best: of bytes without a structure.
void mutateBytes(Bytes& bytes, std::size_t maxSize, Random& random);

void mutateField(ChangePart::Field& field, const TypeDescriptor& type, Random& random) {
    if (field.index >= type.fields.size() || !type.fields[field.index].isMulti) {
        const bool isText = field.index < type.fields.size() && type.fields[field.index].kind == ElementKind::String;
        return mutateBytes(field.value, isText ? field.value.size() + 32 : field.value.size(), random);
    }
    const std::size_t elementSize = infoOf(type.fields[field.index].kind).size;
    switch (random.below(6)) {
        case 0:
            field.size = otherNumber(field.size, random);
            break;
        case 1:
            field.form = otherNumber(field.form, random);
            break;
        case 2: {  // one range more, its elements included
            const std::uint64_t count = 1 + random.below(20);
            field.ranges.push_back({random.below(3), count, Bytes(count * elementSize)});
            field.form += 4;
            field.size += random.below(2) * count;
            break;
        }
        default: {
            if (field.ranges.empty()) break;
            ChangePart::Range& range = anyOf(field.ranges, random);
            if (random.below(3) == 0)
                range.gap = otherNumber(range.gap, random);
            else if (random.below(3) == 0)
                range.count = otherNumber(range.count, random);
            else
                mutateBytes(range.elements, range.elements.size(), random);
        }
    }
}

void mutatePart(ChangePart& part, Random& random) {
    const TypeRegistry& types = allTypes();
    if (part.entries.empty() || random.below(12) == 0) {
        ChangePart::Entry entry;
        entry.op = static_cast<std::uint8_t>(random.below(3));
        entry.id = 1 + random.below(8);
        entry.type = random.below(types.size());
        part.entries.insert(part.entries.begin() + static_cast<std::ptrdiff_t>(random.below(part.entries.size() + 1)),
                            entry);
        return;
    }
    ChangePart::Entry& entry = anyOf(part.entries, random);
    const auto place = part.entries.begin() + (&entry - part.entries.data());
    const TypeDescriptor* type = entry.type < types.size() ? types.at(static_cast<std::uint32_t>(entry.type)) : nullptr;
    switch (random.below(12)) {
        case 0:
            part.entries.insert(place, ChangePart::Entry(entry));
            break;
        case 1:
            part.entries.erase(place);
            break;
        case 2:
            std::swap(entry, anyOf(part.entries, random));
            break;
        case 3:
            entry.id = random.below(2) ? anyOf(part.entries, random).id : otherNumber(entry.id, random);
            break;
        case 4:
            entry.op = static_cast<std::uint8_t>(random.below(4));
            break;
        case 5:
            entry.type = random.below(2) ? random.below(types.size()) : otherNumber(entry.type, random);
            break;
        case 6:
            if (random.below(3) == 0 || part.blobs.empty()) {
                part.blobs.push_back(
                    {{random.next(), random.next()}, random.below(2) ? 4u : 12u, random.below(2) ? 20'000u : 60'000u});
            } else {
                BlobRef& blob = anyOf(part.blobs, random);
                if (random.below(2))
                    blob.elementSize = static_cast<std::uint32_t>(otherNumber(blob.elementSize, random));
                else
                    blob.bytes = otherNumber(blob.bytes, random);
            }
            break;
        case 7:
        case 8: {  // a field comes or goes
            if (!type || type->fields.empty()) break;
            const auto index = static_cast<std::uint32_t>(random.below(type->fields.size()));
            const auto at =
                std::lower_bound(entry.fields.begin(), entry.fields.end(), index,
                                 [](const ChangePart::Field& field, std::uint32_t i) { return field.index < i; });
            if (at != entry.fields.end() && at->index == index)
                entry.fields.erase(at);
            else
                entry.fields.insert(at, fuzz::plainField(*type, index));
            break;
        }
        default:
            if (!entry.fields.empty() && type) mutateField(anyOf(entry.fields, random), *type, random);
    }
}

// Writes the part into libFuzzer's buffer; 0 when it is too long for it.
std::size_t store(const ChangePart& part, std::uint8_t* data, std::size_t maxSize) {
    const Bytes bytes = fuzz::putTogether(part, allTypes());
    if (bytes.size() > maxSize) return 0;
    std::memcpy(data, bytes.data(), bytes.size());
    return bytes.size();
}

}  // namespace
}  // namespace umbriel::wire

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t maxSize);

namespace umbriel::wire {
namespace {

void mutateBytes(Bytes& bytes, std::size_t maxSize, Random& random) {
    const std::size_t size = bytes.size();
    if (maxSize == 0) return;
    bytes.resize(maxSize);
    auto* data = reinterpret_cast<std::uint8_t*>(bytes.data());
    const std::size_t now = LLVMFuzzerMutate(data, size, maxSize);
    bytes.resize(size == maxSize || random.below(2) == 0 ? size : now);  // mostly as long as it was
}

}  // namespace
}  // namespace umbriel::wire

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t maxSize,
                                               unsigned seed) {
    using namespace umbriel;
    test::Random random(seed);
    auto part = fuzz::takeApart(std::as_bytes(std::span(data, size)), wire::allTypes());
    if (!part || random.below(16) == 0) return LLVMFuzzerMutate(data, size, maxSize);
    for (std::size_t n = 1 + random.below(3); n > 0; --n) wire::mutatePart(*part, random);
    const std::size_t stored = wire::store(*part, data, maxSize);
    return stored != 0 ? stored : LLVMFuzzerMutate(data, size, maxSize);
}

// Entries of two parts, in turn.
extern "C" std::size_t LLVMFuzzerCustomCrossOver(const std::uint8_t* data1, std::size_t size1,
                                                 const std::uint8_t* data2, std::size_t size2, std::uint8_t* out,
                                                 std::size_t maxOutSize, unsigned seed) {
    using namespace umbriel;
    test::Random random(seed);
    const auto a = fuzz::takeApart(std::as_bytes(std::span(data1, size1)), wire::allTypes());
    const auto b = fuzz::takeApart(std::as_bytes(std::span(data2, size2)), wire::allTypes());
    if (!a || !b) return 0;
    fuzz::ChangePart joined = *a;
    for (const auto& entry : b->entries)
        joined.entries.insert(
            joined.entries.begin() + static_cast<std::ptrdiff_t>(random.below(joined.entries.size() + 1)), entry);
    return wire::store(joined, out, maxOutSize);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    umbriel::wire::decode(std::as_bytes(std::span(data, size)));
    return 0;
}
