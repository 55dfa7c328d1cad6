#pragma once

#include "common/wire/messages.h"

namespace umbriel::test {

// A message as it stands on the wire, header included.
template <class Message>
wire::Bytes framed(const Message& message, std::uint32_t epoch, std::uint32_t sequence) {
    const wire::Bytes payload = wire::encode(message);
    std::array<std::byte, wire::kHeaderBytes> head;
    wire::encodeHeader({static_cast<std::uint32_t>(payload.size()), static_cast<std::uint8_t>(Message::kType), epoch, sequence},
                       head);
    wire::Bytes bytes(head.begin(), head.end());
    bytes.insert(bytes.end(), payload.begin(), payload.end());
    return bytes;
}

// The messages of a stream: their types, and the text of the last Refuse or Goodbye.
struct Heard {
    std::vector<wire::MessageType> types;
    std::string lastText;
};
inline Heard heard(std::span<const std::byte> stream) {
    Heard result;
    while (stream.size() >= wire::kHeaderBytes) {
        const wire::Header header = wire::decodeHeader(stream.first<wire::kHeaderBytes>());
        if (stream.size() < wire::kHeaderBytes + header.length) break;
        const auto payload = stream.subspan(wire::kHeaderBytes, header.length);
        result.types.push_back(static_cast<wire::MessageType>(header.type));
        if (result.types.back() == wire::MessageType::Refuse || result.types.back() == wire::MessageType::Goodbye)
            if (const auto text = wire::decode<wire::Goodbye>(payload)) result.lastText = text->text;
        stream = stream.subspan(wire::kHeaderBytes + header.length);
    }
    return result;
}

}  // namespace umbriel::test
