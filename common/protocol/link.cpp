#include "common/protocol/link.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace umbriel::protocol {

using wire::MessageType;

namespace {

// Header, what the bytes are, and one of them.
constexpr std::size_t kBlobDataBeginning = wire::kHeaderBytes + wire::BlobData::kOverhead + 1;

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
    UMBRIEL_ASSERT(_borrowed.empty(), "what came before was not looked at");
    _borrowed = bytes;
}

std::span<const std::byte> Link::unread() const {
    return _inputUsed < _input.size() ? std::span<const std::byte>(_input) : _borrowed;
}

bool Link::join(std::size_t bytes) {
    if (_inputUsed == _input.size()) {
        if (_borrowed.size() >= bytes) return true;
        _input.clear();
        _inputUsed = 0;
    }
    if (_input.size() >= bytes) return true;
    const auto taken = _borrowed.first(std::min(bytes - _input.size(), _borrowed.size()));
    _input.insert(_input.end(), taken.begin(), taken.end());
    _borrowed = _borrowed.subspan(taken.size());
    return _input.size() >= bytes;
}

void Link::placed(std::size_t count, TimePoint now) {
    UMBRIEL_ASSERT(count <= moreToCome() && _borrowed.empty(), "what is placed comes next");
    _lastReceived = now;
    _moreToCome -= count;
}

LinkEvent Link::next() {
    if (!_closed && _moreToCome > 0) {
        const auto more = _borrowed.first(std::min(_moreToCome, _borrowed.size()));
        if (more.empty()) return {};
        _moreToCome -= more.size();
        _borrowed = _borrowed.subspan(more.size());
        return {LinkEvent::Kind::More, MessageType::BlobData, more};
    }
    while (!_closed && join(wire::kHeaderBytes)) {
        const wire::Header header = wire::decodeHeader(unread().first<wire::kHeaderBytes>());
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
        const std::size_t size = wire::kHeaderBytes + header.length;
        // Of a blob's part the rest may come later, to where it is to lie.
        const std::size_t needed = type == MessageType::BlobData ? std::min(size, kBlobDataBeginning) : size;
        if (!join(needed)) break;
        const auto message = unread().first(std::min(unread().size(), size));
        ++_receiveSequence;
        if (_inputUsed < _input.size())
            _inputUsed = _input.size();
        else
            _borrowed = _borrowed.subspan(message.size());
        _moreToCome = size - message.size();
        const LinkEvent event = handle(type, message.subspan(wire::kHeaderBytes));
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
    if (type == MessageType::Heartbeat) {
        const auto heartbeat = wire::decode<wire::Heartbeat>(payload);
        if (!heartbeat) return violation(heartbeat.error().message);
        if (heartbeat->wantsAnswer)
            sendHeartbeat(_lastReceived, false,
                          wire::Heartbeat::Echo{heartbeat->sent, _lastReceived.time_since_epoch().count()});
        if (!heartbeat->echo && heartbeat->swaps.empty()) return {};
    }
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
    if (isBulk()) return lookWhetherItReads(now);
    if (now >= _lastReceived + _options.heartbeatLoss)
        return close(fmt::format("{} has been silent for {:.1f} s", peerText(), toSeconds(_options.heartbeatLoss)));
    if (now >= _lastHeartbeat + _options.heartbeatInterval) {
        _lastHeartbeat = now;
        sendHeartbeat(now, _mine.role == wire::Role::Client, {});
    }
}

void Link::lookWhetherItReads(TimePoint now) {
    if (now < _lastHeartbeat + _options.heartbeatInterval) return;
    _lastHeartbeat = now;
    const bool reads = _output.empty() || _output.written() != _writtenThen;
    _writtenThen = _output.written();
    _stalled = reads ? 0 : _stalled + 1;
    if (_stalled >= _options.stalledIntervals)
        close(fmt::format("{} has read nothing of its bulk connection for {:.1f} s", peerText(),
                          _stalled * toSeconds(_options.heartbeatInterval)));
}

void Link::sendHeartbeat(TimePoint now, bool wantsAnswer, std::optional<wire::Heartbeat::Echo> echo) {
    if (!isOpen()) return;
    wire::Heartbeat heartbeat;
    heartbeat.sent = now.time_since_epoch().count();
    heartbeat.wantsAnswer = wantsAnswer;
    heartbeat.echo = echo;
    heartbeat.swaps.assign(_swaps.begin(), _swaps.end());
    const std::uint64_t before = _bytesSent;
    if (send(heartbeat)) _swaps.clear();  // a full queue says as much as a heartbeat
    _bytesSent = before;
}

void Link::reportSwap(std::uint64_t frame, TimePoint at) {
    if (_swaps.size() == wire::Heartbeat::kMaxSwaps) _swaps.pop_front();
    _swaps.push_back({frame, at.time_since_epoch().count()});
}

TimePoint Link::deadline() const {
    if (_closed) return TimePoint::max();
    if (!isOpen()) return _openedAt + _options.handshakeTimeout;
    if (isBulk()) return _lastHeartbeat + _options.heartbeatInterval;
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

std::array<std::byte, wire::kHeaderBytes> Link::header(MessageType type, std::size_t payloadBytes) const {
    UMBRIEL_ASSERT(payloadBytes <= wire::ruleOf(type).limit, "a message is longer than its type allows");
    UMBRIEL_ASSERT(isOpen() || isHandshake(type) || type == MessageType::Goodbye, "only an open link carries messages");
    std::array<std::byte, wire::kHeaderBytes> head;
    const bool withoutEpoch = type == MessageType::Hello || type == MessageType::Refuse;
    wire::encodeHeader({static_cast<std::uint32_t>(payloadBytes), static_cast<std::uint8_t>(type),
                        withoutEpoch ? 0 : _epoch, _sendSequence},
                       head);
    return head;
}

bool Link::counted(bool isQueued, std::size_t payloadBytes) {
    if (!isQueued) return false;
    ++_sendSequence;
    _bytesSent += wire::kHeaderBytes + payloadBytes;
    return true;
}

bool Link::queue(MessageType type, std::span<const std::byte> payload,
                 const std::shared_ptr<const wire::Bytes>& shared) {
    if (_closed) return false;
    const auto head = header(type, payload.size());
    const bool joined = !shared || payload.size() <= kJoinedPayload;
    return counted(joined ? _output.push(head, payload) : _output.push(head, shared), payload.size());
}

bool Link::sendPieces(MessageType type, std::span<const std::byte> head, const std::shared_ptr<const void>& owner,
                      std::span<const std::span<const std::byte>> pieces) {
    if (_closed) return false;
    std::size_t size = head.size();
    for (const auto piece : pieces) size += piece.size();
    const auto messageHead = header(type, size);
    wire::Bytes copied(messageHead.begin(), messageHead.end());
    copied.insert(copied.end(), head.begin(), head.end());
    return counted(_output.push(copied, owner, pieces), size);
}

void Link::close(std::string_view reason) {
    if (_closed) return;
    send(wire::Goodbye{std::string(reason)});
    finish(std::string(reason));
}

void Link::lost(std::string_view reason) {
    if (_closed) return;
    _wasLost = true;
    finish(fmt::format("{} is gone: {}", peerText(), reason));
}

void Link::finish(std::string reason) {
    _closed = true;
    _reason = std::move(reason);
    _input.clear();
    _inputUsed = 0;
    _borrowed = {};
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
    if (!_peerHello && !_address.empty()) return _address + " (which did not say hello)";
    if (!_peerHello) return "a peer that did not say hello";
    return fmt::format("{} '{}'", _peerHello->role == wire::Role::Client ? "client" : "server", _peerHello->name);
}

}  // namespace umbriel::protocol
