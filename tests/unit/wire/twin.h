#pragma once

#include <gtest/gtest.h>

#include "common/scene/digest.h"
#include "common/scene/print.h"
#include "common/wire/change_codec.h"
#include "tests/support/random_scene.h"

namespace umbriel::wire {

// A render server as far as the scene goes: changes arrive as bytes in a waiting aspect, which is committed to the one
// that is drawn.
struct Twin {
    explicit Twin(const TypeRegistry& types) : waiting(types, ids), drawing(types, ids), decoder(waiting) {}

    void receive(const EncodedChanges& encoded) {
        for (const Blob& blob : encoded.blobs)
            if (!blobs.find(blob.ref.hash)) {
                blobs.put(blob);
                blobBytes += blob.ref.bytes;
            }
        for (const Bytes& part : encoded.parts) {
            const auto applied = decoder.apply(part, blobs);
            ASSERT_TRUE(applied.has_value()) << applied.error().message;
        }
        const ChangeList changes = waiting.commit();
        drawing.apply(changes, waiting);
        digest.update(changes, drawing);
    }

    IdSource ids;
    Aspect waiting;
    Aspect drawing;
    BlobStore blobs;
    std::uint64_t blobBytes = 0;
    ChangeDecoder decoder;
    StateDigest digest;
};

// Empty when the graphs and their digests are equal in every field; otherwise what differs.
inline std::string difference(const Aspect& a, const StateDigest& digestA, const Aspect& b,
                              const StateDigest& digestB) {
    if (a.ids() != b.ids()) return "the ids differ";
    for (const ContainerId id : a.ids()) {
        const Container& left = *a.find(id);
        const Container& right = *b.find(id);
        if (const std::string fields = describeDifference(left, right); !fields.empty())
            return "#" + std::to_string(id.value) + " differs in " + fields;
        for (std::uint32_t i = 0; i < left.type().fields.size(); ++i)
            if (digestA.ofField(id, i) != digestB.ofField(id, i))
                return "the digests of #" + std::to_string(id.value) + " field " +
                       std::string(left.type().fields[i].name);
        if (digestA.ofContainer(id) != digestB.ofContainer(id)) return "the digests of #" + std::to_string(id.value);
    }
    if (digestA.total() != digestB.total()) return "the digests' totals differ";
    return a.equals(b) ? "" : "equals() says no";
}

}  // namespace umbriel::wire
