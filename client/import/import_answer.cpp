#include "client/import/import_answer.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "client/import/import_error.h"
#include "common/wire/bytes.h"
#include "common/wire/change_codec.h"

namespace umbriel {
namespace {

constexpr std::size_t kHeaderBytes = 9;
constexpr std::size_t kBlobHeaderBytes = 20;          // hash low, hash high, element size
constexpr std::uint64_t kMaxMessageBytes = 64 << 20;  // of any message but a blob: parts are about 1 MiB
constexpr std::uint64_t kLongestText = 4096;
constexpr std::size_t kPieceBytes = 256 * 1024;

std::span<const std::byte> bytesOf(const std::string& text) {
    return std::as_bytes(std::span(text));
}

std::string textOf(std::span<const std::byte> bytes) {
    std::string text;
    for (const std::byte byte : bytes) {
        const auto c = std::to_integer<unsigned char>(byte);
        text += c < 32 || c == 127 ? ' ' : static_cast<char>(c);
    }
    return text;
}

}  // namespace

bool AnswerWriter::warning(const std::string& text) {
    return message(AnswerKind::Warning, bytesOf(text.substr(0, kLongestText)));
}

bool AnswerWriter::error(const Error& error) {
    const auto kind = error.kind == Error::Kind::BadInput ? AnswerKind::BadInput : AnswerKind::Failure;
    return message(kind, bytesOf(error.message.substr(0, kLongestText)));
}

bool AnswerWriter::polygons(std::uint64_t count) {
    wire::Bytes bytes;
    wire::Writer(bytes).u64(count);
    return message(AnswerKind::Polygons, bytes);
}

bool AnswerWriter::scene(const Aspect& scene, Ref<LoadedScene> loaded) {
    wire::EncodeOptions options;
    options.includeUnshipped = true;
    const wire::EncodedChanges changes = wire::encodeChanges(scene.snapshot(), scene, options);
    for (const wire::Blob& blob : changes.blobs) {
        wire::Bytes start;
        wire::Writer writer(start);
        writer.u64(blob.ref.hash.low);
        writer.u64(blob.ref.hash.high);
        writer.u32(blob.ref.elementSize);
        if (!header(AnswerKind::Blob, start.size() + blob.data.byteSize()) || !write(start)) return false;
        for (std::size_t i = 0; i < blob.data.chunkCount(); ++i)
            if (!write(blob.data.chunk(i))) return false;
    }
    for (const wire::Bytes& part : changes.parts)
        if (!message(AnswerKind::Part, part)) return false;
    wire::Bytes id;
    wire::Writer(id).u64(loaded.id.value);
    return message(AnswerKind::Done, id);
}

bool AnswerWriter::message(AnswerKind kind, std::span<const std::byte> payload) {
    return header(kind, payload.size()) && write(payload);
}

bool AnswerWriter::header(AnswerKind kind, std::uint64_t length) {
    wire::Bytes bytes;
    wire::Writer writer(bytes);
    writer.u8(static_cast<std::uint8_t>(kind));
    writer.u64(length);
    return write(bytes);
}

bool AnswerWriter::write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        const ssize_t sent = ::write(_descriptor, bytes.data(), bytes.size());
        if (sent < 0 && errno == EINTR) continue;
        if (sent <= 0) return false;
        bytes = bytes.subspan(static_cast<std::size_t>(sent));
    }
    return true;
}

// The state of a scene on its way in.
class AnswerReader::Decoding {
 public:
    Decoding(Aspect& into, const wire::DecodeLimits& limits) : _decoder(into, limits) {}

    Result<void> part(std::span<const std::byte> bytes) { return _decoder.apply(bytes, _blobs); }
    void put(wire::Blob blob) { _blobs.put(std::move(blob)); }

 private:
    wire::BlobStore _blobs;
    wire::ChangeDecoder _decoder;
};

AnswerReader::AnswerReader(int descriptor, std::chrono::steady_clock::time_point deadline, std::uint64_t maxBytes)
    : _descriptor(descriptor), _deadline(deadline), _bytesLeft(maxBytes) {}

AnswerReader::~AnswerReader() {
    close(_descriptor);
}

AnswerReader::Got AnswerReader::fill(std::span<std::byte> bytes) {
    while (!bytes.empty()) {
        const auto left = std::chrono::ceil<std::chrono::milliseconds>(_deadline - std::chrono::steady_clock::now());
        if (left.count() <= 0) return Got::Late;
        pollfd waiting{_descriptor, POLLIN, 0};
        const int ready = poll(&waiting, 1, static_cast<int>(std::min<long long>(left.count(), 1'000'000)));
        if (ready == 0 || (ready < 0 && errno == EINTR)) continue;
        const ssize_t got = ready < 0 ? -1 : ::read(_descriptor, bytes.data(), bytes.size());
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return Got::Closed;
        bytes = bytes.subspan(static_cast<std::size_t>(got));
    }
    return Got::All;
}

AnswerReader::End AnswerReader::malformed(std::string reason) {
    _error = failure(std::move(reason));
    return End::Malformed;
}

AnswerReader::End AnswerReader::read(Aspect& into, std::size_t maxContainers) {
    wire::DecodeLimits limits;
    limits.acceptUnshipped = true;
    limits.maxContainers = maxContainers;
    limits.maxMultiBytes = _bytesLeft;
    Decoding decoding(into, limits);
    for (;;) {
        std::array<std::byte, kHeaderBytes> start;
        if (const Got got = fill(start); got != Got::All) return got == Got::Late ? End::Late : End::Closed;
        wire::Reader header(start);
        const auto kind = static_cast<AnswerKind>(header.u8());
        const std::uint64_t length = header.u64();
        if (length > _bytesLeft) return malformed("the answer is larger than the limit");
        _bytesLeft -= length;
        if (kind == AnswerKind::Blob) {
            bool more = false;
            const End end = readBlob(decoding, length, more);
            if (!more) return end;
            continue;
        }
        const bool isText = kind == AnswerKind::Warning || kind == AnswerKind::BadInput || kind == AnswerKind::Failure;
        if (length > (isText ? kLongestText : kMaxMessageBytes)) return malformed("a message is too long");
        wire::Bytes payload(static_cast<std::size_t>(length));
        if (const Got got = fill(payload); got != Got::All) return got == Got::Late ? End::Late : End::Closed;
        switch (kind) {
            case AnswerKind::Warning:
                if (_warnings.size() >= ImportWarnings::kMax) return malformed("there are too many warnings");
                _warnings.push_back(textOf(payload));
                break;
            case AnswerKind::BadInput:
                _error = badInput(textOf(payload));
                return End::Error;
            case AnswerKind::Failure:
                _error = failure(textOf(payload));
                return End::Error;
            case AnswerKind::Part:
                if (const Result<void> applied = decoding.part(payload); !applied)
                    return malformed(applied.error().message);
                break;
            case AnswerKind::Polygons: {
                wire::Reader reader(payload);
                _polygons = reader.u64();
                if (!reader.atEnd()) return malformed("a number is malformed");
                break;
            }
            case AnswerKind::Done: {
                wire::Reader reader(payload);
                _scene = Ref<LoadedScene>(ContainerId{reader.u64()});
                return reader.atEnd() ? End::Done : malformed("the last message is malformed");
            }
            default:
                return malformed("a message is of no known kind");
        }
    }
}

// In pieces, so that a large mesh is in memory once.
AnswerReader::End AnswerReader::readBlob(Decoding& decoding, std::uint64_t length, bool& more) {
    if (length < kBlobHeaderBytes) return malformed("a blob is too short");
    std::array<std::byte, kBlobHeaderBytes> start;
    if (const Got got = fill(start); got != Got::All) return got == Got::Late ? End::Late : End::Closed;
    wire::Reader reader(start);
    wire::BlobRef ref;
    ref.hash.low = reader.u64();
    ref.hash.high = reader.u64();
    ref.elementSize = reader.u32();
    ref.bytes = length - kBlobHeaderBytes;
    wire::BlobAssembler assembler(ref, ref.bytes);
    std::vector<std::byte> piece(kPieceBytes);
    for (std::uint64_t left = ref.bytes; left > 0;) {
        const std::size_t size = static_cast<std::size_t>(std::min<std::uint64_t>(left, piece.size()));
        const std::span<std::byte> target = std::span(piece).first(size);
        if (const Got got = fill(target); got != Got::All) return got == Got::Late ? End::Late : End::Closed;
        if (const Result<void> added = assembler.add(target); !added) return malformed(added.error().message);
        left -= size;
    }
    Result<wire::Blob> blob = assembler.finish();
    if (!blob) return malformed(blob.error().message);
    decoding.put(std::move(*blob));
    more = true;
    return End::Done;
}

}  // namespace umbriel
