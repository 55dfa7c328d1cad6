#pragma once

#include "common/wire/messages.h"

namespace umbriel::bench {

// The bytes of an idle frame's messages, headers included: what the plain loop exchanges.
inline constexpr std::uint64_t kTypicalFrame = 1000;

template <class Message>
wire::Bytes plainBytes(const Message& message) {
    wire::Bytes bytes = wire::encode(message);
    bytes.insert(bytes.begin(), wire::kHeaderBytes, std::byte{0});
    return bytes;
}
inline wire::Bytes plainFrame() {
    wire::Frame frame;
    frame.number = kTypicalFrame;
    return plainBytes(frame);
}
inline wire::Bytes plainReady() {
    wire::Ready ready;
    ready.frame = kTypicalFrame;
    return plainBytes(ready);
}
inline wire::Bytes plainSwap() {
    return plainBytes(wire::Swap{kTypicalFrame});
}

}  // namespace umbriel::bench
