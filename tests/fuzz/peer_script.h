#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>

#include "common/wire/messages.h"

namespace umbriel::fuzz {

// What a peer does, as a fuzzer's input: commands of one byte (operation in the low 3 bits, size of the pieces in which
// its bytes arrive in the high 5; 0: at once) with their operands. Framed messages carry the epoch and sequence that
// are due, so that a session is reached by chance; others spoil one number of the header, or are no messages at all.
enum class PeerOp : std::uint8_t { Raw, Message, OtherMessage, Hello, Spoiled, Time, Turn, Connection };

struct PeerCommand {
    PeerOp op = PeerOp::Raw;
    std::size_t pieceSize = 0;
    std::uint8_t argument = 0;  // type of a message, or whatever the operation makes of it
    std::uint16_t number = 0;   // Spoiled: what and how; Time: milliseconds
    std::span<const std::byte> payload;
};

inline PeerCommand nextCommand(wire::Reader& input) {
    PeerCommand command;
    const std::uint8_t first = input.u8();
    command.op = static_cast<PeerOp>(first & 7);
    command.pieceSize = first >> 3;
    command.argument = input.u8();
    std::size_t size = 0;
    switch (command.op) {
        case PeerOp::Spoiled:
        case PeerOp::Time:
            command.number = input.u16();
            [[fallthrough]];
        case PeerOp::Raw:
            size = command.op == PeerOp::Time ? 0 : input.u8();
            break;
        case PeerOp::Message:
        case PeerOp::OtherMessage:
            size = input.u16();
            break;
        default:
            break;
    }
    command.payload = input.raw(std::min(size, input.remaining()));
    return command;
}

// What its peer counts on one connection.
struct PeerState {
    std::uint32_t epoch = 0;
    std::uint32_t sequence = 0;
};

inline wire::Bytes frameOf(PeerState& state, std::uint8_t type, std::span<const std::byte> payload) {
    using wire::MessageType;
    const bool withoutEpoch =
        type == static_cast<std::uint8_t>(MessageType::Hello) || type == static_cast<std::uint8_t>(MessageType::Refuse);
    wire::Bytes bytes(wire::kHeaderBytes);
    wire::encodeHeader(
        {static_cast<std::uint32_t>(payload.size()), type, withoutEpoch ? 0 : state.epoch, state.sequence++},
        std::span(bytes).first<wire::kHeaderBytes>());
    bytes.insert(bytes.end(), payload.begin(), payload.end());
    return bytes;
}

// The bytes that a command puts on the connection; hello: what a well-behaved peer would say.
inline wire::Bytes bytesOf(const PeerCommand& command, PeerState& state, const wire::Hello& hello) {
    switch (command.op) {
        case PeerOp::Raw:
            return wire::Bytes(command.payload.begin(), command.payload.end());
        case PeerOp::Message:
        case PeerOp::OtherMessage:
            return frameOf(state, command.argument, command.payload);
        case PeerOp::Hello: {
            wire::Bytes bytes =
                frameOf(state, static_cast<std::uint8_t>(wire::MessageType::Hello), wire::encode(hello));
            const wire::Bytes welcome = frameOf(state, static_cast<std::uint8_t>(wire::MessageType::Welcome), {});
            bytes.insert(bytes.end(), welcome.begin(), welcome.end());
            return bytes;
        }
        case PeerOp::Spoiled: {
            wire::Bytes bytes = frameOf(state, command.argument, command.payload);
            bytes[command.number % wire::kHeaderBytes] ^= static_cast<std::byte>(command.number >> 8);
            return bytes;
        }
        default:
            return {};
    }
}

inline void inPieces(std::span<const std::byte> bytes, std::size_t pieceSize,
                     const std::function<void(std::span<const std::byte>)>& receive) {
    if (pieceSize == 0) pieceSize = bytes.size();
    while (!bytes.empty()) {
        const std::size_t count = std::min(pieceSize, bytes.size());
        receive(bytes.first(count));
        bytes = bytes.subspan(count);
    }
}

}  // namespace umbriel::fuzz
