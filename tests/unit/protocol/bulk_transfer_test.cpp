#include "common/protocol/bulk_transfer.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/support/random_scene.h"

namespace umbriel {
namespace {

using protocol::BlobReceiver;

wire::Blob blobOf(std::size_t bytes, test::Random& random) {
    wire::Blob blob{{}, MultiStorage(12)};
    wire::Bytes content(bytes);
    for (std::byte& byte : content) byte = static_cast<std::byte>(random.below(256));
    blob.data.resize(bytes / 12);
    blob.data.write(0, content);
    blob.ref = {wire::hashOfBlob(blob.data), 12, bytes};
    return blob;
}

wire::Bytes bytesOf(const MultiStorage& data) {
    wire::Bytes bytes(data.byteSize());
    data.read(0, bytes);
    return bytes;
}

RC_GTEST_PROP(BlobReceiver, aBlobIsTheSameWhetherItComesInPartsInPiecesOrToWhereItLies, (std::uint64_t seed)) {
    test::Random random(seed);
    const wire::Blob sent = blobOf(12 * (1 + random.below(40'000)), random);
    const wire::Bytes content = bytesOf(sent.data);
    BlobReceiver receiver;
    RC_ASSERT(receiver.expect(sent.ref));
    std::optional<wire::Blob> arrived;
    for (std::size_t at = 0; at < content.size();) {
        RC_ASSERT(!arrived);
        const std::size_t left = content.size() - at;
        std::size_t count = std::min<std::size_t>(left, 1 + random.below(60'000));
        const auto received = [&] {
            const auto next = std::span(content).subspan(at, count);
            const auto how = at == 0 ? 0 : random.below(3);
            if (how == 0) return receiver.part({sent.ref.hash, sent.ref.bytes, at, next});
            if (how == 1) return receiver.more(next);
            std::array<std::span<std::byte>, 3> places;
            const std::size_t given = receiver.room(places);
            std::size_t placed = 0;
            for (std::size_t i = 0; i < given; ++i) {
                const std::size_t size = std::min(places[i].size(), count - placed);
                std::copy_n(next.begin() + static_cast<std::ptrdiff_t>(placed), size, places[i].begin());
                placed += size;
            }
            count = placed;
            return receiver.filled(count);
        };
        auto done = received();
        RC_ASSERT(done.has_value());
        RC_ASSERT(count > 0u);
        at += count;
        if (*done) arrived = std::move(**done);
    }
    RC_ASSERT(arrived.has_value());
    RC_ASSERT(arrived->data.equals(sent.data));
    std::array<std::span<std::byte>, 1> none;
    RC_ASSERT(receiver.room(none) == 0u);
    RC_ASSERT(receiver.more(content).has_error());
}

TEST(TileReceiver, ALayerHasTheBytesOfItsComponents) {
    for (const ComponentType type : {ComponentType::Float, ComponentType::Half, ComponentType::Byte})
        for (const std::size_t bytesOfComponent : {1u, 2u, 4u}) {
            protocol::TileReceiver receiver;
            receiver.expect(7, {{3, {0, 0, 5, 2}, Eye::Mono}});
            const wire::Bytes pixels(10 * 4 * bytesOfComponent);
            const auto done = receiver.part({7, 3, 0, 1, Layer::Colour, "colour", 4, type, pixels.size(), 0, pixels});
            ASSERT_EQ(done.has_value(), umbriel::bytesOf(type) == bytesOfComponent);
            if (!done) continue;
            EXPECT_TRUE(*done);
            const auto tiles = receiver.take();
            EXPECT_EQ(tiles.at(0).layers.at(0).components, type);
            EXPECT_EQ(tiles[0].layers[0].pixels.size(), pixels.size());
        }
}

TEST(BlobReceiver, MoreThanABlobsBytesIsRefused) {
    test::Random random(5);
    const wire::Blob sent = blobOf(1200, random);
    const wire::Bytes content = bytesOf(sent.data);
    BlobReceiver receiver;
    receiver.expect(sent.ref);
    ASSERT_TRUE(receiver.part({sent.ref.hash, sent.ref.bytes, 0, std::span(content).first(10)}));
    EXPECT_TRUE(receiver.more(content).has_error());
}

TEST(BlobReceiver, WhatLiesWhereItShouldButIsSomethingElseIsRefused) {
    test::Random random(7);
    const wire::Blob sent = blobOf(120'000, random);
    wire::Bytes content = bytesOf(sent.data);
    content[100'000] ^= std::byte{1};
    BlobReceiver receiver;
    receiver.expect(sent.ref);
    ASSERT_TRUE(receiver.part({sent.ref.hash, sent.ref.bytes, 0, std::span(content).first(10)}));
    std::array<std::span<std::byte>, 16> places;
    const std::size_t given = receiver.room(places);
    std::size_t at = 10;
    for (std::size_t i = 0; i < given; at += places[i++].size())
        std::copy_n(content.begin() + static_cast<std::ptrdiff_t>(at), places[i].size(), places[i].begin());
    ASSERT_EQ(at, content.size());
    EXPECT_TRUE(receiver.filled(at - 10).has_error());
}

}  // namespace
}  // namespace umbriel
