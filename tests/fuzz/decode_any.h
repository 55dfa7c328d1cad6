#pragma once

#include <algorithm>

#include "common/base/assert.h"
#include "common/wire/messages.h"

namespace umbriel::fuzz {

// Whether a payload is read as this message. What is read has exactly one encoding: the bytes it came from.
template <class Message>
bool decodesAs(std::span<const std::byte> payload) {
    const auto message = wire::decode<Message>(payload);
    if (!message) {
        UMBRIEL_ASSERT(!message.error().message.empty(), "a refusal without a reason");
        return false;
    }
    const wire::Bytes again = wire::encode(*message);
    UMBRIEL_ASSERT(std::equal(again.begin(), again.end(), payload.begin(), payload.end()),
                   "a message is read from bytes that are not its encoding");
    return true;
}

// Likewise by its number; false for a number that is no message.
inline bool decodesAs(std::uint8_t type, std::span<const std::byte> payload) {
    using wire::MessageType;
    if (!wire::ruleOf(type)) return false;
    switch (static_cast<MessageType>(type)) {
        case MessageType::Hello: {
            // One of another version is kept as far as it can be read, to be refused by name.
            const auto hello = wire::decode<wire::Hello>(payload);
            return hello && (hello->version != wire::kProtocolVersion || decodesAs<wire::Hello>(payload));
        }
        case MessageType::Welcome:
            return decodesAs<wire::Welcome>(payload);
        case MessageType::Refuse:
            return decodesAs<wire::Refuse>(payload);
        case MessageType::Heartbeat:
            return decodesAs<wire::Heartbeat>(payload);
        case MessageType::Goodbye:
            return decodesAs<wire::Goodbye>(payload);
        case MessageType::Assign:
            return decodesAs<wire::Assign>(payload);
        case MessageType::Changes:
            return decodesAs<wire::Changes>(payload);
        case MessageType::Frame:
            return decodesAs<wire::Frame>(payload);
        case MessageType::Ready:
            return decodesAs<wire::Ready>(payload);
        case MessageType::Swap:
            return decodesAs<wire::Swap>(payload);
        case MessageType::Failed:
            return decodesAs<wire::Failed>(payload);
        case MessageType::BlobWanted:
            return decodesAs<wire::BlobWanted>(payload);
        case MessageType::BlobData:
            return decodesAs<wire::BlobData>(payload);
        case MessageType::TileData:
            return decodesAs<wire::TileData>(payload);
        case MessageType::DigestQuery:
            return decodesAs<wire::DigestQuery>(payload);
        case MessageType::DigestReply:
            return decodesAs<wire::DigestReply>(payload);
        case MessageType::Explain:
            return decodesAs<wire::Explain>(payload);
        case MessageType::ExplainReply:
            return decodesAs<wire::ExplainReply>(payload);
        case MessageType::JobOffer:
            return decodesAs<wire::JobOffer>(payload);
        case MessageType::JobLease:
            return decodesAs<wire::JobLease>(payload);
        case MessageType::JobCancel:
            return decodesAs<wire::JobCancel>(payload);
        case MessageType::JobDone:
            return decodesAs<wire::JobDone>(payload);
    }
    return false;
}

}  // namespace umbriel::fuzz
