#include "common/wire/messages.h"

#include <algorithm>
#include <cmath>

namespace umbriel::wire {
namespace {

constexpr std::uint32_t kMagic = 0x52424d55;  // "UMBR"
// No wall is larger than this along a side, so that sums of positions and sizes cannot overflow.
constexpr std::int32_t kMaxPixels = 1 << 24;

void writeHash(Writer& writer, const Hash128& hash) {
    writer.u64(hash.low);
    writer.u64(hash.high);
}

Hash128 readHash(Reader& reader) {
    Hash128 hash;
    hash.low = reader.u64();
    hash.high = reader.u64();
    return hash;
}

template <class Enum>
Enum readEnum(Reader& reader, std::uint32_t count, const char* reason) {
    return static_cast<Enum>(reader.bounded(count - 1, reason));
}

// Whether a layer may have such components: ids are no floats, and only colours have fewer bits.
bool areOf(Layer layer, ComponentType components) {
    if (layer == Layer::Ids) return components == ComponentType::Uint;
    return components == ComponentType::Float || (layer == Layer::Colour && components != ComponentType::Uint);
}

// Of the messages about a job: which, and which attempt at it.
template <class Message>
void writeAttempt(Writer& writer, const Message& message) {
    writer.varint(message.job);
    writer.varint(message.attempt);
}
template <class Message>
void readAttempt(Reader& reader, Message& message) {
    message.job = reader.varint();
    message.attempt = static_cast<std::uint32_t>(reader.bounded(~std::uint32_t{0}, "the attempt is too large"));
}

// The largest depth that travels: as a float, with the lower half of its bits empty.
constexpr float kMaxDepth = std::bit_cast<float>(std::uint32_t{0x7f7f0000});

// The upper half of a non-negative float, rounded towards zero or away from it: 8 bits of mantissa.
std::uint16_t roundedDown(float value) {
    if (!(value > 0.0f)) return 0;
    return static_cast<std::uint16_t>(std::bit_cast<std::uint32_t>(std::min(value, kMaxDepth)) >> 16);
}
std::uint16_t roundedUp(float value) {
    if (!(value > 0.0f)) return 0;
    return static_cast<std::uint16_t>((std::bit_cast<std::uint32_t>(std::min(value, kMaxDepth)) + 0xffff) >> 16);
}
float readRounded(Reader& reader) {
    const float value = std::bit_cast<float>(std::uint32_t{reader.u16()} << 16);
    if (std::signbit(value) || !std::isfinite(value)) reader.fail("a depth is not a distance");
    return reader.ok() ? value : 0.0f;
}

// A text of the peer that ends up in messages and logs: no control characters.
std::string readLabel(Reader& reader, std::size_t limit) {
    std::string text = reader.text(limit);
    for (const char c : text)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) reader.fail("a name has control characters");
    return text;
}

constexpr std::uint64_t kMaxReadyTriangles = (std::uint64_t{1} << 35) - 1;  // 5 bytes as varint
constexpr std::uint64_t kMaxReadyTime = (std::uint64_t{1} << 21) - 1;       // 3 bytes, steps of 10 microseconds
constexpr std::uint64_t kMaxCostTime = (std::uint64_t{1} << 25) - 1;        // 4 bytes, likewise: 16 cores are busy at once
constexpr std::uint64_t kMaxCostBytes = (std::uint64_t{1} << 42) - 1;       // 6 bytes

// Milliseconds in steps of 10 microseconds.
std::uint64_t inSteps(double milliseconds, std::uint64_t limit) {
    return static_cast<std::uint64_t>(std::clamp(milliseconds * 100.0 + 0.5, 0.0, static_cast<double>(limit)));
}

enum FrameFlags : std::uint8_t { kWantPixels = 1, kFromNothing = 2, kTime = 4, kViews = 8, kWantCost = 16 };
enum HeartbeatFlags : std::uint8_t { kWantsAnswer = 1, kEcho = 2 };

// A monotonic clock does not get there in 36 years: sums and differences of a few such times do not overflow.
std::int64_t readTime(Reader& reader) {
    constexpr std::int64_t kLatest = std::int64_t{1} << 60;  // nanoseconds
    const auto time = static_cast<std::int64_t>(reader.u64());
    if (time <= kLatest && time >= -kLatest) return time;
    reader.fail("a heartbeat's time is impossible");
    return 0;
}

}  // namespace

void Heartbeat::write(Writer& writer) const {
    UMBRIEL_ASSERT(swaps.size() <= kMaxSwaps, "senders keep the newest");
    writer.u8(static_cast<std::uint8_t>((wantsAnswer ? kWantsAnswer : 0) | (echo ? kEcho : 0)));
    writer.u64(static_cast<std::uint64_t>(sent));
    if (echo) {
        writer.u64(static_cast<std::uint64_t>(echo->sent));
        writer.u64(static_cast<std::uint64_t>(echo->received));
    }
    writer.varint(swaps.size());
    for (const Swap& swap : swaps) {
        writer.varint(swap.frame);
        writer.u64(static_cast<std::uint64_t>(swap.at));
    }
}
Heartbeat Heartbeat::read(Reader& reader) {
    Heartbeat heartbeat;
    const std::uint8_t flags = reader.u8();
    if (flags & ~(kWantsAnswer | kEcho)) reader.fail("a heartbeat's flags are unknown");
    heartbeat.wantsAnswer = flags & kWantsAnswer;
    heartbeat.sent = readTime(reader);
    if (flags & kEcho) {
        const std::int64_t sent = readTime(reader);
        heartbeat.echo = Echo{sent, readTime(reader)};
    }
    const std::size_t count = reader.count(9, kMaxSwaps);
    heartbeat.swaps.reserve(count);
    for (std::size_t i = 0; i < count && reader.ok(); ++i) {
        const std::uint64_t frame = reader.varint();
        heartbeat.swaps.push_back({frame, readTime(reader)});
    }
    return heartbeat;
}

void Hello::write(Writer& writer) const {
    writer.u32(kMagic);
    writer.u16(version);
    writer.text(build);
    writer.u8(static_cast<std::uint8_t>(role));
    writer.u8(static_cast<std::uint8_t>(channel));
    writer.text(name);
    writer.text(wantedName);
    writer.u64(token.low);
    writer.u64(token.high);
    writer.u32(epoch);
    writer.u64(typeSignature);
    writer.u64(capabilities);
    writer.u64(needs);
    writer.u64(maxChangeBytes);
    writer.u64(maxBlobBytes);
    writer.text(glRenderer);
    writer.text(glVersion);
    writer.text(cpu);
}

Hello Hello::read(Reader& reader) {
    Hello hello;
    if (reader.u32() != kMagic) {
        reader.fail("this is not an Umbriel peer");
        return hello;
    }
    hello.version = reader.u16();
    hello.build = readLabel(reader, kMaxName);
    if (hello.version != kProtocolVersion) {
        if (reader.ok()) reader.raw(reader.remaining());  // another version's business
        return hello;
    }
    hello.role = readEnum<Role>(reader, 2, "the role is neither client nor server");
    hello.channel = readEnum<Channel>(reader, 2, "the channel is neither control nor bulk");
    hello.name = readLabel(reader, kMaxName);
    hello.wantedName = readLabel(reader, kMaxName);
    hello.token.low = reader.u64();
    hello.token.high = reader.u64();
    hello.epoch = reader.u32();
    hello.typeSignature = reader.u64();
    hello.capabilities = reader.u64();
    hello.needs = reader.u64();
    hello.maxChangeBytes = reader.u64();
    hello.maxBlobBytes = reader.u64();
    hello.glRenderer = readLabel(reader, kMaxText);
    hello.glVersion = readLabel(reader, kMaxText);
    hello.cpu = readLabel(reader, kMaxText);
    return hello;
}

void Assign::write(Writer& writer) const {
    writer.varint(static_cast<std::uint32_t>(wall.width));
    writer.varint(static_cast<std::uint32_t>(wall.height));
    writer.varint(tiles.size());
    for (const TileAssignment& tile : tiles) {
        writer.varint(tile.tile);
        writer.varint(static_cast<std::uint32_t>(tile.pixels.x));
        writer.varint(static_cast<std::uint32_t>(tile.pixels.y));
        writer.varint(static_cast<std::uint32_t>(tile.pixels.width));
        writer.varint(static_cast<std::uint32_t>(tile.pixels.height));
        writer.varint(static_cast<std::uint32_t>(tile.eye));
    }
}

Assign Assign::read(Reader& reader) {
    const auto pixels = [&] { return static_cast<std::int32_t>(reader.bounded(kMaxPixels, "a pixel count is too large")); };
    Assign assign;
    assign.wall.width = pixels();
    assign.wall.height = pixels();
    const std::size_t count = reader.count(6, kMaxTiles);
    assign.tiles.reserve(count);
    for (std::size_t i = 0; i < count && reader.ok(); ++i) {
        TileAssignment tile;
        tile.tile = static_cast<std::uint32_t>(reader.bounded(~std::uint32_t{0}, "a tile's index is too large"));
        tile.pixels.x = pixels();
        tile.pixels.y = pixels();
        tile.pixels.width = pixels();
        tile.pixels.height = pixels();
        tile.eye = readEnum<Eye>(reader, kEnumCount<Eye>, "a tile's eye is unknown");
        if (tile.pixels.empty() || tile.pixels.x + tile.pixels.width > assign.wall.width ||
            tile.pixels.y + tile.pixels.height > assign.wall.height)
            reader.fail("a tile is not on the wall");
        assign.tiles.push_back(tile);
    }
    return assign;
}

void Frame::write(Writer& writer) const {
    writer.varint(number);
    writer.u8(static_cast<std::uint8_t>((wantPixels ? kWantPixels : 0) | (fromNothing ? kFromNothing : 0) |
                                        (time ? kTime : 0) | (views.empty() ? 0 : kViews) |
                                        (wantCost ? kWantCost : 0)));
    if (time) writer.f64(*time);
    if (!views.empty()) {
        writer.varint(views.size());
        writer.raw(views);
    }
    writer.raw(changes);
}

Frame Frame::read(Reader& reader) {
    Frame frame;
    frame.number = reader.varint();
    const std::uint8_t flags = reader.u8();
    if (flags & ~(kWantPixels | kFromNothing | kTime | kViews | kWantCost)) reader.fail("unknown flags");
    frame.wantPixels = (flags & kWantPixels) != 0;
    frame.fromNothing = (flags & kFromNothing) != 0;
    frame.wantCost = (flags & kWantCost) != 0;
    if (flags & kTime) frame.time = reader.finiteF64();
    if (flags & kViews) {
        const auto size = static_cast<std::size_t>(reader.bounded(kMaxViewBytes, "the views are too long"));
        if (size == 0) reader.fail("the views are empty");
        frame.views = reader.raw(size);
    }
    if (reader.remaining() > kMaxInlineChangeBytes) reader.fail("too many change bytes in one frame message");
    frame.changes = reader.raw(reader.remaining());
    return frame;
}

void Ready::write(Writer& writer) const {
    writer.u16(frame);
    writer.u64(digest);
    writer.varint(inSteps(drawMilliseconds, kMaxReadyTime));
    writer.varint(std::min(triangles, kMaxReadyTriangles));
    writer.varint(std::min(shadowTriangles, kMaxReadyTriangles));
    writer.u16(roundedDown(nearestDepth));
    writer.u16(roundedUp(farthestDepth));
    if (!cost) return;
    writer.varint(inSteps(cost->cpuMilliseconds, kMaxCostTime));
    writer.varint(inSteps(cost->gpuMilliseconds, kMaxCostTime));
    writer.varint(std::min(cost->shadowMapBytes, kMaxCostBytes));
}

Ready Ready::read(Reader& reader) {
    Ready ready;
    ready.frame = reader.u16();
    ready.digest = reader.u64();
    ready.drawMilliseconds = static_cast<double>(reader.bounded(kMaxReadyTime, "the draw time is too long")) / 100.0;
    ready.triangles = reader.bounded(kMaxReadyTriangles, "too many triangles");
    ready.shadowTriangles = reader.bounded(kMaxReadyTriangles, "too many triangles");
    ready.nearestDepth = readRounded(reader);
    ready.farthestDepth = readRounded(reader);
    if (!reader.ok() || reader.atEnd()) return ready;
    FrameCost cost;
    cost.cpuMilliseconds = static_cast<double>(reader.bounded(kMaxCostTime, "the processor time is too long")) / 100.0;
    cost.gpuMilliseconds = static_cast<double>(reader.bounded(kMaxCostTime, "the GPU time is too long")) / 100.0;
    cost.shadowMapBytes = reader.bounded(kMaxCostBytes, "too many bytes of shadow maps");
    ready.cost = cost;
    return ready;
}

void Failed::write(Writer& writer) const {
    writer.varint(frame);
    writer.text(std::string_view(text).substr(0, kMaxText));
}

Failed Failed::read(Reader& reader) {
    Failed failed;
    failed.frame = reader.varint();
    failed.text = reader.text(kMaxText);
    return failed;
}

void BlobWanted::write(Writer& writer) const {
    writer.varint(hashes.size());
    for (const Hash128& hash : hashes) writeHash(writer, hash);
}

BlobWanted BlobWanted::read(Reader& reader) {
    BlobWanted wanted;
    const std::size_t count = reader.count(16, kMaxHashes);
    wanted.hashes.reserve(count);
    for (std::size_t i = 0; i < count; ++i) wanted.hashes.push_back(readHash(reader));
    return wanted;
}

void BlobData::write(Writer& writer) const {
    writeHash(writer, hash);
    writer.u64(total);
    writer.u64(offset);
    writer.raw(bytes);
}

BlobData BlobData::read(Reader& reader) {
    BlobData data;
    data.hash = readHash(reader);
    data.total = reader.u64();
    data.offset = reader.u64();
    data.bytes = reader.raw(reader.remaining());
    if (data.total > kMaxBlobBytes) reader.fail("the blob is too large");
    else if (data.offset > data.total || data.bytes.size() > data.total - data.offset)
        reader.fail("a part reaches past the blob's end");
    else if (data.bytes.empty() && data.total != 0) reader.fail("a part is empty");
    return data;
}

void TileData::write(Writer& writer) const {
    writer.varint(frame);
    writer.varint(tile);
    writer.varint(layerIndex);
    writer.varint(layerCount);
    writer.varint(static_cast<std::uint32_t>(layer));
    writer.text(std::string_view(name).substr(0, kMaxName));
    writer.varint(channels);
    writer.u8(static_cast<std::uint8_t>(components));
    writer.varint(total);
    writer.varint(offset);
    writer.raw(bytes);
}

TileData TileData::read(Reader& reader) {
    TileData data;
    data.frame = reader.varint();
    data.tile = static_cast<std::uint32_t>(reader.bounded(~std::uint32_t{0}, "a tile's index is too large"));
    data.layerIndex = static_cast<std::uint32_t>(reader.bounded(kMaxLayers - 1, "too many layers"));
    data.layerCount = static_cast<std::uint32_t>(reader.bounded(kMaxLayers, "too many layers"));
    data.layer = static_cast<Layer>(reader.bounded(static_cast<std::uint32_t>(Layer::LightFactors), "unknown layer"));
    if (!std::has_single_bit(static_cast<std::uint32_t>(data.layer))) reader.fail("unknown layer");
    data.name = reader.text(kMaxName);
    data.channels = static_cast<std::uint32_t>(reader.bounded(kMaxChannels, "too many channels"));
    const std::uint8_t components = reader.u8();
    if (components > static_cast<std::uint8_t>(ComponentType::Byte)) reader.fail("unknown components of a layer");
    data.components = static_cast<ComponentType>(components);
    data.total = reader.varint();
    data.offset = reader.varint();
    data.bytes = reader.raw(reader.remaining());
    if (data.layerIndex >= data.layerCount) reader.fail("a layer beyond the last");
    if (data.channels == 0) reader.fail("a layer without channels");
    if (!areOf(data.layer, data.components)) reader.fail("a layer with components of another kind");
    if (data.bytes.empty()) reader.fail("a part is empty");
    if (data.offset > data.total || data.bytes.size() > data.total - data.offset)
        reader.fail("a part reaches past the layer's end");
    return data;
}

void DigestQuery::write(Writer& writer) const {
    writer.u64(container.value);
    writer.u64(after.value);
}

DigestQuery DigestQuery::read(Reader& reader) {
    DigestQuery query;
    query.container.value = reader.u64();
    query.after.value = reader.u64();
    return query;
}

void DigestReply::write(Writer& writer) const {
    writer.u8(more ? 1 : 0);
    writer.varint(digests.size());
    for (const auto& [key, digest] : digests) {
        writer.u64(key);
        writer.u64(digest);
    }
}

DigestReply DigestReply::read(Reader& reader) {
    DigestReply reply;
    reply.more = reader.boolean();
    const std::size_t count = reader.count(16, kMaxEntries);
    reply.digests.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint64_t key = reader.u64();
        reply.digests.emplace_back(key, reader.u64());
    }
    return reply;
}

void JobOffer::write(Writer& writer) const {
    writeAttempt(writer, *this);
    writer.varint(leaseMilliseconds);
    writer.text(kind);
    writer.varint(blobs.size());
    for (const BlobRef& blob : blobs) {
        writeHash(writer, blob.hash);
        writer.varint(blob.elementSize);
        writer.varint(blob.bytes);
    }
    writer.raw(payload);
}

JobOffer JobOffer::read(Reader& reader) {
    JobOffer offer;
    readAttempt(reader, offer);
    offer.leaseMilliseconds = static_cast<std::uint32_t>(reader.bounded(~std::uint32_t{0}, "the lease is too long"));
    offer.kind = reader.text(kMaxKind);
    const std::size_t blobs = reader.count(18, kMaxBlobs);
    for (std::size_t i = 0; i < blobs; ++i) {
        BlobRef blob;
        blob.hash = readHash(reader);
        blob.elementSize = static_cast<std::uint32_t>(reader.bounded(MultiStorage::kChunkBytes, "the blob's elements are too large"));
        blob.bytes = reader.bounded(kMaxBlobBytes, "the blob is too large");
        if (blob.elementSize == 0 || blob.bytes % blob.elementSize != 0)
            reader.fail("the blob does not consist of whole elements");
        if (!reader.ok()) break;
        offer.blobs.push_back(blob);
    }
    offer.payload = reader.raw(reader.remaining());
    if (offer.payload.size() > kMaxPayload) reader.fail("the job's description is too long");
    return offer;
}

void JobLease::write(Writer& writer) const {
    writeAttempt(writer, *this);
    writer.f32(progress);
}

JobLease JobLease::read(Reader& reader) {
    JobLease lease;
    readAttempt(reader, lease);
    lease.progress = reader.finiteF32();
    return lease;
}

void JobCancel::write(Writer& writer) const {
    writeAttempt(writer, *this);
}

JobCancel JobCancel::read(Reader& reader) {
    JobCancel cancel;
    readAttempt(reader, cancel);
    return cancel;
}

void JobDone::write(Writer& writer) const {
    writeAttempt(writer, *this);
    writer.u8(static_cast<std::uint8_t>(status));
    writer.text(std::string_view(text).substr(0, kMaxText));
    writeHash(writer, result);
    writer.varint(resultBytes);
    writer.varint(cpuMicroseconds);
}

JobDone JobDone::read(Reader& reader) {
    JobDone done;
    readAttempt(reader, done);
    done.status = readEnum<JobStatus>(reader, 4, "the job's end is unknown");
    done.text = reader.text(kMaxText);
    done.result = readHash(reader);
    done.resultBytes = reader.bounded(kMaxBlobBytes, "the result is too large");
    done.cpuMicroseconds = reader.varint();
    return done;
}

}  // namespace umbriel::wire
