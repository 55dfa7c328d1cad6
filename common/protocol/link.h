#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/base/clock.h"
#include "common/protocol/send_queue.h"
#include "common/wire/messages.h"

namespace umbriel::protocol {

// When a connection counts as failed, and how much may wait to be written (queueLimit, bytes).
struct LinkOptions {
    Duration handshakeTimeout = std::chrono::seconds(5);
    Duration heartbeatInterval = std::chrono::seconds(1);
    Duration heartbeatLoss = std::chrono::seconds(2);  // this long without a byte: the peer is lost
    // Bulk: so many heartbeat intervals with bytes waiting, none of them taken: the peer does not read. Counted, not
    // measured: a program that was stopped itself has not waited for its peer.
    int stalledIntervals = 5;
    std::size_t queueLimit = std::size_t{64} << 20;
};

// What the bytes that came mean to the side that has the link.
struct LinkEvent {
    enum class Kind {
        None,     // the bytes that came so far hold no further event
        Hello,    // peerHello() is there: accept() or refuse() before asking for the next event
        Open,     // both sides have accepted
        Message,  // type and payload, of BlobData the beginning of it; the payload is valid until the next call
        More,     // of the BlobData before, as payload; likewise
        Closed    // reason() says why; reported once
    };
    Kind kind = Kind::None;
    wire::MessageType type = wire::MessageType::Hello;
    std::span<const std::byte> payload;
};

// One connection to a peer: framing, handshake, heartbeat, epochs and sequences, a bounded queue. Whatever the peer does
// wrong closes it with a reason. Before the peer was accepted it costs one hello's bytes and the handshake's time.
class Link {
 public:
    // Says hello. now: when the connection came to be.
    Link(const LinkOptions& options, wire::Hello mine, TimePoint now);

    // The bytes are borrowed until next() has found no further event in them.
    void received(std::span<const std::byte> bytes, TimePoint now);
    // Bytes are decoded as events are asked for: where they are, when a message lies in them as a whole.
    LinkEvent next();
    // How many of the bytes that come next belong to the BlobData that has begun: whoever knows where they are to lie
    // may put them there himself instead of giving them to received(). After next() has found no further event.
    std::size_t moreToCome() const { return _closed ? 0 : _moreToCome; }
    void placed(std::size_t count, TimePoint now);
    // Sends heartbeats, closes a link that is silent for too long.
    void advance(TimePoint now);
    TimePoint deadline() const;

    // Answers to the Hello event. epoch: of the session, that both sides' messages carry from now on.
    void accept(std::uint32_t epoch);
    void refuse(std::string_view reason);

    // False when the queue is full: the peer then misses a message and can only be closed.
    template <class Message>
    bool send(const Message& message) {
        if (wire::ruleOf(Message::kType).limit > kJoinedPayload)
            return sendShared(Message::kType, std::make_shared<const wire::Bytes>(wire::encode(message)));
        _scratch.clear();
        wire::Writer writer(_scratch);
        message.write(writer);
        return queue(Message::kType, _scratch, nullptr);
    }
    // payload: encoded by wire::encode, possibly shared with other links.
    bool sendShared(wire::MessageType type, const std::shared_ptr<const wire::Bytes>& payload) {
        return queue(type, *payload, payload);
    }
    // A payload that begins with head, which is copied, and goes on with pieces, which are written from where they are:
    // they stay there while the owner lives.
    bool sendPieces(wire::MessageType type, std::span<const std::byte> head, const std::shared_ptr<const void>& owner,
                    std::span<const std::span<const std::byte>> pieces);

    // A heartbeat that asks for the peer's time. The answer comes as a message.
    void ask(TimePoint now) { sendHeartbeat(now, true, {}); }
    // Travels with the next heartbeats; when there are too many, the newest.
    void reportSwap(std::uint64_t frame, TimePoint at);

    // Says goodbye; the owner lets the queue drain and closes the connection.
    void close(std::string_view reason);
    // The connection is gone.
    void lost(std::string_view reason);

    bool isOpen() const { return _accepted && _welcomed && !_closed; }
    bool isClosed() const { return _closed; }
    TimePoint lastReceived() const { return _lastReceived; }
    // Why it was closed, for people; names the peer when it is known.
    const std::string& reason() const { return _reason; }
    // The connection ended under it: neither side said why.
    bool wasLost() const { return _wasLost; }
    // Whoever dialled knows what the connection is for; the other side's hello says control.
    bool isBulk() const;
    const std::optional<wire::Hello>& peerHello() const { return _peerHello; }
    const wire::Hello& ownHello() const { return _mine; }
    // HOST:PORT that was dialled: names the peer until it has said hello.
    void setAddress(std::string address) { _address = std::move(address); }
    // "server 'left'", "left:7420 (which did not say hello)" or "a peer that did not say hello".
    std::string peerText() const;
    SendQueue& output() { return _output; }
    const SendQueue& output() const { return _output; }
    // Everything queued so far, headers included, heartbeats apart.
    std::uint64_t bytesSent() const { return _bytesSent; }

 private:
    // Payloads up to this size are copied behind their head: one short write for several messages.
    static constexpr std::size_t kJoinedPayload = 1024;

    // shared: the payload's owner, if it is to be shared.
    bool queue(wire::MessageType type, std::span<const std::byte> payload,
               const std::shared_ptr<const wire::Bytes>& shared);
    // Checks that the message may be sent, and makes its header.
    std::array<std::byte, wire::kHeaderBytes> header(wire::MessageType type, std::size_t payloadBytes) const;
    bool counted(bool isQueued, std::size_t payloadBytes);
    // What is next, as far as it lies in one piece.
    std::span<const std::byte> unread() const;
    // Makes that piece so long. False when so much has not come; all that has is in it then.
    bool join(std::size_t bytes);
    void sendHeartbeat(TimePoint now, bool wantsAnswer, std::optional<wire::Heartbeat::Echo> echo);
    void finish(std::string reason);
    LinkEvent violation(std::string_view what);
    void lookWhetherItReads(TimePoint now);
    LinkEvent handle(wire::MessageType type, std::span<const std::byte> payload);

    LinkOptions _options;
    wire::Hello _mine;
    std::string _address;
    std::optional<wire::Hello> _peerHello;
    SendQueue _output;
    std::deque<wire::Heartbeat::Swap> _swaps;
    wire::Bytes _scratch;  // of the message that is encoded
    wire::Bytes _input;                  // the beginning of a message whose rest was not there yet
    std::size_t _inputUsed = 0;          // 0, or all of it
    std::span<const std::byte> _borrowed;  // follows
    std::size_t _moreToCome = 0;           // of a BlobData message that has begun
    std::uint32_t _epoch = 0;
    std::uint32_t _sendSequence = 0;
    std::uint32_t _receiveSequence = 0;
    std::uint64_t _bytesSent = 0;
    bool _accepted = false;
    bool _welcomed = false;
    bool _closed = false;
    bool _wasLost = false;
    bool _closedReported = false;
    std::string _reason;
    TimePoint _openedAt;
    TimePoint _lastReceived;
    TimePoint _lastHeartbeat;  // bulk: when it was last looked at whether the peer reads
    std::uint64_t _writtenThen = 0;
    int _stalled = 0;  // intervals
};

}  // namespace umbriel::protocol
