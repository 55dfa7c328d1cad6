// Blobs and tiles that come in pieces, as any peer may cut, mix, repeat and shorten them. Input: what is announced,
// then pieces; with the first bit set the announced hash is the right one, so that whole blobs can be finished, too.

#include <algorithm>

#include "common/base/assert.h"
#include "common/protocol/bulk_transfer.h"

namespace umbriel {
namespace {

constexpr std::uint64_t kMaxBytes = 1 << 20;

std::span<const std::byte> some(wire::Reader& input, std::size_t wanted) {
    return input.raw(std::min(wanted, input.remaining()));
}

MultiStorage contentOf(std::uint32_t elementSize, std::span<const std::byte> bytes) {
    MultiStorage content(elementSize);
    content.resize(bytes.size() / elementSize);
    content.write(0, bytes.first(bytes.size() - bytes.size() % elementSize));
    return content;
}

// All that is left of the input, in pieces of lengths that change.
void assemble(wire::Reader& input, std::uint8_t flags) {
    wire::BlobRef ref;
    ref.elementSize = input.u16();
    ref.bytes = input.u32() % (2 * kMaxBytes);
    const std::size_t step = input.u16();
    const auto bytes = input.raw(input.remaining());
    if (flags & 2) ref.bytes = bytes.size();
    if ((flags & 1) && ref.elementSize > 0 && ref.elementSize <= MultiStorage::kChunkBytes)
        ref.hash = wire::hashOfBlob(contentOf(ref.elementSize, bytes));
    wire::BlobAssembler assembler(ref, kMaxBytes);
    for (std::size_t at = 0; at < bytes.size() && !assembler.complete();) {
        const std::size_t count = std::min(bytes.size() - at, step + at % 7);
        const auto added = assembler.add(bytes.subspan(at, count));
        if (!added) {
            UMBRIEL_ASSERT(!added.error().message.empty(), "a refusal without a reason");
            return;
        }
        at += count == 0 ? 1 : count;
    }
    if (!assembler.complete()) return;
    if (const auto blob = assembler.finish()) {
        UMBRIEL_ASSERT(blob->ref == ref && blob->data.byteSize() == ref.bytes, "a blob of another size");
        UMBRIEL_ASSERT(wire::hashOfBlob(blob->data) == ref.hash, "a blob that does not bear its name");
    }
}

// BlobData messages for two blobs that were asked for and others that were not.
void receiveBlobs(wire::Reader& input) {
    const auto content = some(input, input.u16() % 2048);
    const std::uint32_t elementSize = 1 + input.u8() % 16;
    const MultiStorage whole = contentOf(elementSize, content);
    const wire::BlobRef right{wire::hashOfBlob(whole), elementSize, whole.byteSize()};
    const wire::BlobRef wrong{{1, 2}, elementSize, 4 * elementSize};
    protocol::BlobReceiver receiver;
    receiver.expect(right);
    receiver.expect(wrong);
    std::vector<std::byte> bytes(whole.byteSize());
    whole.read(0, bytes);
    std::uint64_t offset = 0;
    while (!input.atEnd() && input.ok()) {
        const std::uint8_t flags = input.u8();
        wire::BlobData data;
        data.hash = flags & 1 ? right.hash : Hash128{flags, 2};
        data.total = flags & 2 ? right.bytes : wrong.bytes;
        data.offset = flags & 4 ? offset : input.u16();
        const std::size_t count = input.u16() % 1024;
        data.bytes = (flags & 5) == 5
                         ? std::span<const std::byte>(bytes).subspan(
                               std::min<std::size_t>(offset, bytes.size()),
                               std::min<std::size_t>(count, bytes.size() - std::min<std::size_t>(offset, bytes.size())))
                         : some(input, count);
        const auto part = receiver.part(data);
        if (!part) {
            UMBRIEL_ASSERT(!part.error().message.empty(), "a refusal without a reason");
            return;
        }
        if ((flags & 5) == 5) offset += data.bytes.size();
        if (*part)
            UMBRIEL_ASSERT(wire::hashOfBlob((*part)->data) == (*part)->ref.hash, "a blob that does not bear its name");
    }
}

// TileData messages for two small tiles.
void receiveTiles(wire::Reader& input) {
    protocol::TileReceiver receiver;
    receiver.expect(7, {{0, {0, 0, 3, 2}, Eye::Mono}, {5, {3, 0, 4, 2}, Eye::Mono}});
    std::uint64_t sent = 0;
    while (!input.atEnd() && input.ok()) {
        const std::size_t size = input.u16() % 1024;
        const auto payload = some(input, size);
        const auto data = wire::decode<wire::TileData>(payload);
        if (!data) continue;
        sent += data->bytes.size();
        const auto done = receiver.part(*data);
        if (!done) return;
        if (!*done) continue;
        std::uint64_t bytes = 0;
        for (const TilePixels& tile : receiver.take())
            for (const TileLayer& layer : tile.layers) {
                UMBRIEL_ASSERT(layer.pixels.size() == static_cast<std::size_t>(tile.tile.pixels.area()) *
                                                          layer.channels * bytesOf(layer.components),
                               "a layer of another size");
                bytes += layer.pixels.size();
            }
        UMBRIEL_ASSERT(bytes <= sent, "tiles have more bytes than came");
        return;
    }
}

}  // namespace
}  // namespace umbriel

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    umbriel::wire::Reader input(std::as_bytes(std::span(data, size)));
    const std::uint8_t flags = input.u8();
    switch (flags >> 6) {
        case 0:
            umbriel::receiveBlobs(input);
            break;
        case 1:
            umbriel::receiveTiles(input);
            break;
        default:
            umbriel::assemble(input, flags);
            break;
    }
    return 0;
}
