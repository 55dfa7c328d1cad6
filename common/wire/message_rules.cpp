// Which message types there are, what each may be, and the header that precedes every one.

#include "common/wire/messages.h"

#include <fmt/format.h>

namespace umbriel::wire {
namespace {

constexpr std::uint32_t kKiB = 1024;

constexpr bool kYes = true, kNo = false;
//                                          limit             client server control bulk
constexpr MessageRule kRules[kMessageTypes] = {
    {"Hello",        4 * kKiB - kHeaderBytes,     kYes, kYes, kYes, kYes},
    {"Welcome",      0,                           kYes, kYes, kYes, kYes},
    {"Refuse",       1 * kKiB,                    kYes, kYes, kYes, kYes},
    {"Heartbeat",    18 * Heartbeat::kMaxSwaps + 32, kYes, kYes, kYes, kNo},
    {"Goodbye",      1 * kKiB,                    kYes, kYes, kYes, kYes},
    {"Assign",       64 * kKiB,                   kYes, kNo,  kYes, kNo},
    {"Changes",      kChunkBytes,                 kYes, kNo,  kYes, kNo},
    {"Frame",        kMaxViewBytes + kMaxInlineChangeBytes + 64, kYes, kNo, kYes, kNo},
    {"Ready",        41,                          kNo,  kYes, kYes, kNo},
    {"Swap",         10,                          kYes, kNo,  kYes, kNo},
    {"Failed",       4 * kKiB,                    kNo,  kYes, kYes, kNo},
    {"BlobWanted",   64 * kKiB + 8,               kYes, kYes, kYes, kNo},
    {"BlobData",     kChunkBytes + BlobData::kOverhead, kYes, kYes, kNo, kYes},
    {"TileData",     kChunkBytes + 512,           kNo,  kYes, kNo,  kYes},
    {"DigestQuery",  16,                          kYes, kNo,  kYes, kNo},
    {"DigestReply",  16 * DigestReply::kMaxEntries + 16, kNo, kYes, kYes, kNo},
    {"Explain",      0,                           kYes, kNo,  kYes, kNo},
    {"ExplainReply", (1 << 20) + 8,               kNo,  kYes, kYes, kNo},
    {"JobOffer",     kChunkBytes + 2 * kKiB,      kYes, kNo,  kYes, kNo},
    {"JobLease",     32,                          kNo,  kYes, kYes, kNo},
    {"JobCancel",    32,                          kYes, kNo,  kYes, kNo},
    {"JobDone",      4 * kKiB + 80,               kNo,  kYes, kYes, kNo},
};

}  // namespace

const MessageRule* ruleOf(std::uint8_t type) {
    return type >= 1 && type <= kMessageTypes ? &kRules[type - 1] : nullptr;
}

Error malformed(MessageType type, std::string_view reason) {
    return failure(fmt::format("a {} message cannot be read: {}", ruleOf(type).name, reason));
}

void encodeHeader(const Header& header, std::span<std::byte, kHeaderBytes> out) {
    const auto little = [&](std::size_t at, std::uint32_t value) {
        for (std::size_t i = 0; i < 4; ++i) out[at + i] = static_cast<std::byte>(value >> (8 * i));
    };
    little(0, header.length);
    out[4] = std::byte{header.type};
    little(5, header.epoch);
    little(9, header.sequence);
}

Header decodeHeader(std::span<const std::byte, kHeaderBytes> bytes) {
    Reader reader(bytes);
    Header header;
    header.length = reader.u32();
    header.type = reader.u8();
    header.epoch = reader.u32();
    header.sequence = reader.u32();
    return header;
}

std::string capabilityNames(std::uint64_t capabilities) {
    constexpr std::string_view kNames[] = {"pixels", "swap times", "jobs"};
    std::string names;
    for (std::size_t bit = 0; bit < 64; ++bit) {
        if (!(capabilities >> bit & 1)) continue;
        if (!names.empty()) names += ", ";
        names += bit < std::size(kNames) ? std::string(kNames[bit]) : fmt::format("capability {}", bit);
    }
    return names;
}

}  // namespace umbriel::wire
