#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/assert.h"
#include "common/base/hash.h"
#include "common/base/result.h"
#include "common/scene/container_id.h"
#include "common/wall/tile_pixels.h"
#include "common/wire/blob.h"
#include "common/wire/bytes.h"

// The messages between client and render servers, as bytes and back. Pure functions: no sockets, no state. The layout of
// every message is in docs/protocol.md.
namespace umbriel::wire {

inline constexpr std::uint16_t kProtocolVersion = 1;
inline constexpr std::size_t kHeaderBytes = 13;
// What one bulk message carries at most, so that a heartbeat never waits for more than this behind it.
inline constexpr std::size_t kChunkBytes = 256 * 1024;
// Change bytes of one frame, blobs apart: a snapshot of millions of containers.
inline constexpr std::size_t kMaxChangeBytes = std::size_t{512} << 20;
// Change bytes up to this size travel inside the frame message.
inline constexpr std::size_t kMaxInlineChangeBytes = 64 * 1024;
// Two eyes that see 256 lights with six shadow maps each need 1.1 MB.
inline constexpr std::size_t kMaxViewBytes = 1536 * 1024;
inline constexpr std::uint64_t kMaxBlobBytes = std::uint64_t{4} << 30;

enum class MessageType : std::uint8_t {
    Hello = 1, Welcome, Refuse, Heartbeat, Goodbye,
    Assign, Changes, Frame, Ready, Swap, Failed,
    BlobWanted, BlobData, TileData,
    DigestQuery, DigestReply, Explain, ExplainReply,
    JobOffer, JobLease, JobCancel, JobDone
};
inline constexpr std::uint8_t kMessageTypes = static_cast<std::uint8_t>(MessageType::JobDone);

// What a program can do for its peer beyond what every version of the protocol demands; bits of Hello::capabilities.
enum Capability : std::uint64_t {
    kReturnsPixels = 1,  // a server answers a frame that wants pixels with them
    kReportsSwaps = 2,   // its heartbeats say when it showed which frame
    kWorksOnJobs = 4     // it takes offers of jobs
};
inline constexpr std::uint64_t kKnownCapabilities = kReturnsPixels | kReportsSwaps | kWorksOnJobs;
// "pixels, jobs"; unknown ones by number.
std::string capabilityNames(std::uint64_t capabilities);

enum class Role : std::uint8_t { Client, Server };
enum class Channel : std::uint8_t { Control, Bulk };

// What is fixed about a message type: who may send it where, and how long its payload may be.
struct MessageRule {
    std::string_view name;
    std::uint32_t limit;  // payload bytes
    bool fromClient;
    bool fromServer;
    bool onControl;
    bool onBulk;
};
// Null for a number that is no message type.
const MessageRule* ruleOf(std::uint8_t type);
inline const MessageRule& ruleOf(MessageType type) { return *ruleOf(static_cast<std::uint8_t>(type)); }

// What every message begins with; kHeaderBytes when encoded.
struct Header {
    std::uint32_t length = 0;    // payload bytes that follow
    std::uint8_t type = 0;
    std::uint32_t epoch = 0;     // of the session; 0 in Hello and Refuse
    std::uint32_t sequence = 0;  // counts this connection's messages in this direction from 0, wraps
};
void encodeHeader(const Header& header, std::span<std::byte, kHeaderBytes> out);
Header decodeHeader(std::span<const std::byte, kHeaderBytes> bytes);

// 128 random bits that name a session; the client chooses them, its bulk connection shows them again.
struct Token {
    std::uint64_t low = 0;
    std::uint64_t high = 0;
    friend bool operator==(const Token&, const Token&) = default;
};

// The first message of either side.
struct Hello {
    static constexpr MessageType kType = MessageType::Hello;
    static constexpr std::size_t kMaxName = 128;
    static constexpr std::size_t kMaxText = 256;

    std::uint16_t version = kProtocolVersion;
    std::string build;                // of the program, for messages: "0.1.0"
    Role role = Role::Client;
    Channel channel = Channel::Control;
    std::string name;                 // of the sender
    std::string wantedName;           // what the receiver must be called; empty: anything
    Token token;                      // of the session; a server's control connection leaves it 0
    std::uint32_t epoch = 0;          // of the session, from 1; a server's control connection leaves it 0
    std::uint64_t typeSignature = 0;  // TypeRegistry::signature()
    std::uint64_t capabilities = 0;   // what the sender can do; unknown ones are ignored
    std::uint64_t needs = 0;          // what the receiver must be able to do; unknown ones it cannot
    // What the sender takes of one frame's changes and of one blob; the receiver sends no more.
    std::uint64_t maxChangeBytes = kMaxChangeBytes;
    std::uint64_t maxBlobBytes = kMaxBlobBytes;
    std::string glRenderer;           // servers: bit-equal pictures are promised among equal ones only
    std::string glVersion;
    std::string cpu;

    void write(Writer& writer) const;
    // Stops after `build` when the magic or the version differ: what follows is unknown then.
    static Hello read(Reader& reader);
};

// The receiver's hello was accepted.
struct Welcome {
    static constexpr MessageType kType = MessageType::Welcome;
    void write(Writer&) const {}
    static Welcome read(Reader&) { return {}; }
};

template <MessageType Type, std::size_t MaxText>
struct TextMessage {
    static constexpr MessageType kType = Type;
    static constexpr std::size_t kMaxText = MaxText;
    std::string text;

    // Cut to what the receiver allows.
    void write(Writer& writer) const { writer.text(std::string_view(text).substr(0, MaxText)); }
    static TextMessage read(Reader& reader) { return {reader.text(MaxText)}; }
};
// Why the receiver's hello was not accepted; the sender closes after it.
using Refuse = TextMessage<MessageType::Refuse, 1000>;
// Why the sender closes.
using Goodbye = TextMessage<MessageType::Goodbye, 1000>;
using ExplainReply = TextMessage<MessageType::ExplainReply, 1 << 20>;

// Somebody is there. Times are nanoseconds on the clock of who read them, from whatever beginning.
struct Heartbeat {
    static constexpr MessageType kType = MessageType::Heartbeat;
    static constexpr std::size_t kMaxSwaps = 512;
    // Of a heartbeat that asked for an answer, which this is.
    struct Echo {
        std::int64_t sent = 0;      // as it said
        std::int64_t received = 0;  // on the clock of who answers
    };
    struct Swap {
        std::uint64_t frame = 0;
        std::int64_t at = 0;
    };
    std::int64_t sent = 0;
    bool wantsAnswer = false;
    std::optional<Echo> echo;
    std::vector<Swap> swaps;  // of servers: what was shown since the last one

    void write(Writer& writer) const;
    static Heartbeat read(Reader& reader);
};

// The parts of the wall that the server draws from now on.
struct Assign {
    static constexpr MessageType kType = MessageType::Assign;
    static constexpr std::size_t kMaxTiles = 1024;
    PixelSize wall;
    std::vector<TileAssignment> tiles;

    void write(Writer& writer) const;
    static Assign read(Reader& reader);
};

// A part of the next frame's change bytes; parts are joined in order.
struct Changes {
    static constexpr MessageType kType = MessageType::Changes;
    std::span<const std::byte> bytes;

    void write(Writer& writer) const { writer.raw(bytes); }
    static Changes read(Reader& reader) { return {reader.raw(reader.remaining())}; }
};

// Draw this frame. Spans borrow from the message.
struct Frame {
    static constexpr MessageType kType = MessageType::Frame;
    std::uint64_t number = 0;
    bool wantPixels = false;
    bool wantCost = false;                      // Ready says what the frame cost
    bool fromNothing = false;                   // the changes are a snapshot: empty the scene first
    std::optional<double> time;                 // seconds; absent: as in the last frame
    std::span<const std::byte> views;           // encodeViews; empty: as in the last frame
    std::span<const std::byte> changes;         // what Changes messages did not bring

    void write(Writer& writer) const;
    static Frame read(Reader& reader);
};

// What a frame cost a server. Only sent when asked for.
struct FrameCost {
    double cpuMilliseconds = 0.0;    // of all threads of the server while it drew; steps of 0.01, at most 335 s
    double gpuMilliseconds = 0.0;    // by timer queries; 0: not measured (a software renderer's queries lie)
    std::uint64_t shadowMapBytes = 0;  // at most 2^42 - 1

    friend bool operator==(const FrameCost&, const FrameCost&) = default;
};

// A frame is drawn and waits for its swap.
struct Ready {
    static constexpr MessageType kType = MessageType::Ready;
    std::uint16_t frame = 0;            // the low bits of its number
    std::uint64_t digest = 0;           // of the state it was drawn from
    double drawMilliseconds = 0.0;      // in steps of 0.01, at most 20 s
    std::uint64_t triangles = 0;        // at most 2^35 - 1
    std::uint64_t shadowTriangles = 0;  // likewise
    float nearestDepth = 0.0f;          // metres; rounded down to 8 bits of mantissa
    float farthestDepth = 0.0f;         // metres; rounded up likewise
    std::optional<FrameCost> cost;      // when the frame asked for it

    void write(Writer& writer) const;
    static Ready read(Reader& reader);
};

// All servers are ready: show the frame.
struct Swap {
    static constexpr MessageType kType = MessageType::Swap;
    std::uint64_t frame = 0;

    void write(Writer& writer) const { writer.varint(frame); }
    static Swap read(Reader& reader) { return {reader.varint()}; }
};

// A frame (or another request) could not be served; the session goes on.
struct Failed {
    static constexpr MessageType kType = MessageType::Failed;
    static constexpr std::size_t kMaxText = 4000;
    std::uint64_t frame = 0;
    std::string text;

    void write(Writer& writer) const;
    static Failed read(Reader& reader);
};

// Please send these blobs; either side may ask.
struct BlobWanted {
    static constexpr MessageType kType = MessageType::BlobWanted;
    static constexpr std::size_t kMaxHashes = 4096;
    std::vector<Hash128> hashes;

    void write(Writer& writer) const;
    static BlobWanted read(Reader& reader);
};

// A part of a blob that was asked for; parts come in order.
struct BlobData {
    static constexpr MessageType kType = MessageType::BlobData;
    static constexpr std::size_t kOverhead = 16 + 8 + 8;
    Hash128 hash;
    std::uint64_t total = 0;   // bytes of the blob
    std::uint64_t offset = 0;  // of this part
    std::span<const std::byte> bytes;

    void write(Writer& writer) const;
    static BlobData read(Reader& reader);
};

// A part of one layer of a drawn tile, as it lies in TileLayer::pixels; parts come in order.
struct TileData {
    static constexpr MessageType kType = MessageType::TileData;
    static constexpr std::size_t kMaxName = 200;
    static constexpr std::size_t kMaxLayers = 256;
    static constexpr std::uint32_t kMaxChannels = 16;
    std::uint64_t frame = 0;
    std::uint32_t tile = 0;         // TileAssignment::tile
    std::uint32_t layerIndex = 0;
    std::uint32_t layerCount = 0;   // of this tile
    Layer layer = Layer::Colour;
    std::string name;
    std::uint32_t channels = 4;
    ComponentType components = ComponentType::Float;
    std::uint64_t total = 0;        // bytes of the layer
    std::uint64_t offset = 0;
    std::span<const std::byte> bytes;

    void write(Writer& writer) const;
    static TileData read(Reader& reader);
};

// Asks for digests of the state last drawn: of containers, or of one container's fields.
struct DigestQuery {
    static constexpr MessageType kType = MessageType::DigestQuery;
    ContainerId container;  // 0: containers in ascending order
    ContainerId after;      // containers with greater ids only

    void write(Writer& writer) const;
    static DigestQuery read(Reader& reader);
};

struct DigestReply {
    static constexpr MessageType kType = MessageType::DigestReply;
    static constexpr std::size_t kMaxEntries = 8192;
    bool more = false;  // containers follow after the last one here
    std::vector<std::pair<std::uint64_t, std::uint64_t>> digests;  // (container id or field index, digest)

    void write(Writer& writer) const;
    static DigestReply read(Reader& reader);
};

// Asks for the plan of the last frame as text.
struct Explain {
    static constexpr MessageType kType = MessageType::Explain;
    void write(Writer&) const {}
    static Explain read(Reader&) { return {}; }
};

// Work to be done beside drawing.
struct JobOffer {
    static constexpr MessageType kType = MessageType::JobOffer;
    static constexpr std::size_t kMaxKind = 64;
    static constexpr std::size_t kMaxPayload = 256 * 1024;
    static constexpr std::size_t kMaxBlobs = 32;
    std::uint64_t job = 0;
    std::uint32_t attempt = 0;  // from 1; answers to an older attempt are ignored
    std::uint32_t leaseMilliseconds = 0;
    std::string kind;
    std::span<const std::byte> payload;
    std::vector<BlobRef> blobs;  // contents that the job needs: the server asks for those it lacks

    void write(Writer& writer) const;
    static JobOffer read(Reader& reader);
};

// The server works on the job; repeated while it does, which renews the lease.
struct JobLease {
    static constexpr MessageType kType = MessageType::JobLease;
    std::uint64_t job = 0;
    std::uint32_t attempt = 0;
    float progress = 0.0f;  // 0..1

    void write(Writer& writer) const;
    static JobLease read(Reader& reader);
};

struct JobCancel {
    static constexpr MessageType kType = MessageType::JobCancel;
    std::uint64_t job = 0;
    std::uint32_t attempt = 0;

    void write(Writer& writer) const;
    static JobCancel read(Reader& reader);
};

enum class JobStatus : std::uint8_t { Done, Failed, Cancelled, Refused };

// The job ended. A result waits on the server as a blob: the client asks for it with BlobWanted, or lets go of it with
// JobCancel.
struct JobDone {
    static constexpr MessageType kType = MessageType::JobDone;
    static constexpr std::size_t kMaxText = 4000;
    std::uint64_t job = 0;
    std::uint32_t attempt = 0;
    JobStatus status = JobStatus::Done;
    std::string text;                 // why not done
    Hash128 result;                   // 0 when resultBytes is 0
    std::uint64_t resultBytes = 0;
    std::uint64_t cpuMicroseconds = 0;  // of the processor, as far as the server knows what worked on it

    void write(Writer& writer) const;
    static JobDone read(Reader& reader);
};

// Payload bytes of a message. Longer than its type allows is a programming error: senders split.
template <class Message>
Bytes encode(const Message& message) {
    Bytes bytes;
    Writer writer(bytes);
    message.write(writer);
    UMBRIEL_ASSERT(bytes.size() <= ruleOf(Message::kType).limit, "a message is longer than its type allows");
    return bytes;
}

Error malformed(MessageType type, std::string_view reason);

// The whole payload must be the message: what is missing or left over is an error that names the type.
template <class Message>
Result<Message> decode(std::span<const std::byte> payload) {
    Reader reader(payload);
    Message message = Message::read(reader);
    if (!reader.ok()) return malformed(Message::kType, reader.reason());
    if (!reader.atEnd()) return malformed(Message::kType, "bytes are left over");
    return message;
}

}  // namespace umbriel::wire
