#include "common/protocol/link.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace umbriel::protocol {

using wire::MessageType;

namespace {

bool isHandshake(MessageType type) {
    return type == MessageType::Hello || type == MessageType::Welcome || type == MessageType::Refuse;
}

}  // namespace

Link::Link(const LinkOptions& options, wire::Hello mine, TimePoint now)
    : _options(options), _mine(std::move(mine)), _output(options.queueLimit), _openedAt(now), _lastReceived(now),
      _lastHeartbeat(now) {
    send(_mine);
}

void Link::received(std::span<const std::byte> bytes, TimePoint now) {
    if (_closed) return;
    _lastReceived = now;
    if (_inputUsed > 0) {
        _input.erase(_input.begin(), _input.begin() + static_cast<std::ptrdiff_t>(_inputUsed));
        _inputUsed = 0;
    }
    _input.insert(_input.end(), bytes.begin(), bytes.end());
}

LinkEvent Link::next() {
    while (!_closed && _input.size() - _inputUsed >= wire::kHeaderBytes) {
        const auto unread = std::span<const std::byte>(_input).subspan(_inputUsed);
        const wire::Header header = wire::decodeHeader(unread.first<wire::kHeaderBytes>());
        const wire::MessageRule* rule = wire::ruleOf(header.type);
        if (!rule) return violation(fmt::format("message type {} is unknown", header.type));
        const auto type = static_cast<MessageType>(header.type);
        if (!_peerHello && type != MessageType::Hello) return violation("the first message is not a hello");
        if (header.length > rule->limit)
            return violation(fmt::format("a {} message of {} bytes, {} are allowed", rule->name, header.length, rule->limit));
        if (header.sequence != _receiveSequence)
            return violation(fmt::format("message {} came where {} was due", header.sequence, _receiveSequence));
        const bool withoutEpoch = type == MessageType::Hello || type == MessageType::Refuse ||
                                  (type == MessageType::Goodbye && header.epoch == 0);
        if (header.epoch != (withoutEpoch ? 0 : _epoch))
            return violation(fmt::format("a {} message of session epoch {} in epoch {}", rule->name, header.epoch, _epoch));
        if (_peerHello) {
            const bool client = _peerHello->role == wire::Role::Client;
            const bool control = !isBulk();
            if (!(client ? rule->fromClient : rule->fromServer) || !(control ? rule->onControl : rule->onBulk))
                return violation(fmt::format("a {} message does not belong on a {}'s {} connection", rule->name,
                                             client ? "client" : "server", control ? "control" : "bulk"));
        }
        if (unread.size() - wire::kHeaderBytes < header.length) break;
        ++_receiveSequence;
        _inputUsed += wire::kHeaderBytes + header.length;
        const LinkEvent event = handle(type, unread.subspan(wire::kHeaderBytes, header.length));
        if (event.kind != LinkEvent::Kind::None) return event;
    }
    if (_closed && !_closedReported) {
        _closedReported = true;
        return {LinkEvent::Kind::Closed, MessageType::Goodbye, {}};
    }
    return {};
}

LinkEvent Link::handle(MessageType type, std::span<const std::byte> payload) {
    if (type == MessageType::Hello) {
        if (_peerHello) return violation("a second hello");
        auto hello = wire::decode<wire::Hello>(payload);
        if (!hello) return violation(hello.error().message);
        _peerHello = std::move(*hello);
        return {LinkEvent::Kind::Hello, type, payload};
    }
    if (type == MessageType::Goodbye || type == MessageType::Refuse) {
        const auto text = wire::decode<wire::Goodbye>(payload);
        if (!text) return violation(text.error().message);
        finish(fmt::format("{} {}: {}", peerText(), type == MessageType::Refuse ? "refuses" : "has left", text->text));
        return {};
    }
    if (type == MessageType::Welcome) {
        if (_welcomed || !_accepted) return violation("an unexpected welcome");
        _welcomed = true;
        return {LinkEvent::Kind::Open, type, payload};
    }
    if (!isOpen()) return violation(fmt::format("a {} message before the welcome", wire::ruleOf(type).name));
    if (type == MessageType::Heartbeat) return {};
    return {LinkEvent::Kind::Message, type, payload};
}

void Link::advance(TimePoint now) {
    if (_closed) return;
    if (!isOpen()) {
        if (now >= _openedAt + _options.handshakeTimeout)
            close(fmt::format("{} did not complete the handshake within {:.1f} s", peerText(),
                              toSeconds(_options.handshakeTimeout)));
        return;
    }
    if (isBulk()) return;
    if (now >= _lastReceived + _options.heartbeatLoss)
        return close(fmt::format("{} has been silent for {:.1f} s", peerText(), toSeconds(_options.heartbeatLoss)));
    if (now >= _lastHeartbeat + _options.heartbeatInterval) {
        _lastHeartbeat = now;
        const std::uint64_t before = _bytesSent;
        send(wire::Heartbeat{});  // a full queue says as much as a heartbeat
        _bytesSent = before;
    }
}

TimePoint Link::deadline() const {
    if (_closed) return TimePoint::max();
    if (!isOpen()) return _openedAt + _options.handshakeTimeout;
    if (isBulk()) return TimePoint::max();
    return std::min(_lastReceived + _options.heartbeatLoss, _lastHeartbeat + _options.heartbeatInterval);
}

void Link::accept(std::uint32_t epoch) {
    UMBRIEL_ASSERT(_peerHello && !_accepted, "only a hello can be accepted, once");
    if (_closed) return;
    _epoch = epoch;
    _accepted = true;
    send(wire::Welcome{});
}

void Link::refuse(std::string_view reason) {
    if (_closed) return;
    send(wire::Refuse{std::string(reason)});
    finish(std::string(reason));
}

bool Link::queue(MessageType type, std::span<const std::byte> payload,
                 const std::shared_ptr<const wire::Bytes>& shared) {
    if (_closed) return false;
    const wire::MessageRule& rule = wire::ruleOf(type);
    UMBRIEL_ASSERT(payload.size() <= rule.limit, "a message is longer than its type allows");
    UMBRIEL_ASSERT(isOpen() || isHandshake(type) || type == MessageType::Goodbye, "only an open link carries messages");
    std::array<std::byte, wire::kHeaderBytes> head;
    const bool withoutEpoch = type == MessageType::Hello || type == MessageType::Refuse;
    wire::encodeHeader({static_cast<std::uint32_t>(payload.size()), static_cast<std::uint8_t>(type),
                        withoutEpoch ? 0 : _epoch, _sendSequence},
                       head);
    const bool joined = !shared || payload.size() <= kJoinedPayload;
    if (!(joined ? _output.push(head, payload) : _output.push(head, shared))) return false;
    ++_sendSequence;
    _bytesSent += head.size() + payload.size();
    return true;
}

void Link::close(std::string_view reason) {
    if (_closed) return;
    send(wire::Goodbye{std::string(reason)});
    finish(std::string(reason));
}

void Link::lost(std::string_view reason) {
    if (!_closed) finish(fmt::format("{} is gone: {}", peerText(), reason));
}

void Link::finish(std::string reason) {
    _closed = true;
    _reason = std::move(reason);
    _input.clear();
    _inputUsed = 0;
}

LinkEvent Link::violation(std::string_view what) {
    close(fmt::format("{} broke the protocol: {}", peerText(), what));
    _closedReported = true;
    return {LinkEvent::Kind::Closed, MessageType::Goodbye, {}};
}

bool Link::isBulk() const {
    return _mine.channel == wire::Channel::Bulk || (_peerHello && _peerHello->channel == wire::Channel::Bulk);
}

std::string Link::peerText() const {
    if (!_peerHello) return "a peer that did not say hello";
    return fmt::format("{} '{}'", _peerHello->role == wire::Role::Client ? "client" : "server", _peerHello->name);
}

}  // namespace umbriel::protocol
