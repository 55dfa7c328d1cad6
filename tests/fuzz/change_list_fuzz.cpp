// Any bytes, as the parts of a change list: refused with a reason, or sound edits within the memory that was sent.

#include <cstdint>

#include "common/base/assert.h"
#include "common/scene/digest.h"
#include "common/scene/print.h"
#include "common/wire/change_codec.h"
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

void decode(std::span<const std::byte> part) {
    TypeRegistry types;
    registerCoreTypes(types);
    types.add<test::EveryKind>();
    IdSource ids;
    Aspect aspect(types, ids);
    aspect.create<Node>("there already");
    aspect.create<test::EveryKind>();
    aspect.commit();
    const AnyBlob blobs;
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

}  // namespace
}  // namespace umbriel::wire

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    umbriel::wire::decode(std::as_bytes(std::span(data, size)));
    return 0;
}
