// One connection from its first byte on: header, handshake, messages, in arbitrary pieces and with time passing.
// Whatever the peer does, the link ends with a reason or goes on, and keeps no more than one message of it.

#include "common/base/assert.h"
#include "common/protocol/handshake.h"
#include "common/protocol/link.h"
#include "tests/fuzz/decode_any.h"
#include "tests/fuzz/peer_script.h"

namespace umbriel {
namespace {

constexpr std::uint32_t kEpoch = 3;

wire::Hello helloOf(wire::Role role, wire::Channel channel) {
    wire::Hello hello;
    hello.name = role == wire::Role::Client ? "desk" : "left";
    hello.build = "fuzz";
    hello.role = role;
    hello.channel = channel;
    hello.epoch = role == wire::Role::Client ? kEpoch : 0;
    return hello;
}

class Connection {
 public:
    Connection(wire::Role mine, wire::Channel channel)
        : _mine(helloOf(mine, channel)),
          _theirs(helloOf(mine == wire::Role::Client ? wire::Role::Server : wire::Role::Client, channel)),
          _link({}, _mine, _now) {
        _peer.epoch = kEpoch;
    }

    void run(wire::Reader& input) {
        while (input.ok() && !input.atEnd()) {
            const fuzz::PeerCommand command = fuzz::nextCommand(input);
            if (command.op == fuzz::PeerOp::Time) {
                _now += std::chrono::milliseconds(command.number);
                _link.advance(_now);
                UMBRIEL_ASSERT(_link.isClosed() || _link.deadline() > _now,
                               "a deadline has passed and nothing happened");
                events();
            } else if (command.op == fuzz::PeerOp::Turn) {
                _link.output().consumed(std::min<std::size_t>(_link.output().size(), command.argument * 16u));
            } else if (command.op == fuzz::PeerOp::Connection) {
                _link.lost("reset by peer");
                events();
            } else {
                const wire::Bytes bytes = fuzz::bytesOf(command, _peer, _theirs);
                fuzz::inPieces(bytes, command.pieceSize, [&](std::span<const std::byte> piece) {
                    _link.received(piece, _now);
                    events();
                });
            }
        }
    }

 private:
    using Kind = protocol::LinkEvent::Kind;

    void events() {
        for (;;) {
            const protocol::LinkEvent event = _link.next();
            if (event.kind == Kind::None) return;
            UMBRIEL_ASSERT(!_closed, "an event after the last one");
            switch (event.kind) {
                case Kind::Hello:
                    UMBRIEL_ASSERT(_link.peerHello().has_value() && !_link.isOpen(), "a hello that is not there");
                    if (const auto objection = protocol::handshakeObjection(_mine, *_link.peerHello());
                        !objection.empty())
                        _link.refuse(objection);
                    else
                        _link.accept(kEpoch);
                    break;
                case Kind::Message:
                    UMBRIEL_ASSERT(_link.isOpen(), "a message before the welcome");
                    UMBRIEL_ASSERT(event.payload.size() <= wire::ruleOf(event.type).limit,
                                   "a message beyond its limit");
                    if (!fuzz::decodesAs(static_cast<std::uint8_t>(event.type), event.payload))
                        _link.close("malformed");
                    break;
                case Kind::Closed:
                    UMBRIEL_ASSERT(_link.isClosed() && !_link.reason().empty(), "closed without a reason");
                    _closed = true;
                    break;
                default:
                    break;
            }
        }
    }

    TimePoint _now{};
    wire::Hello _mine;
    wire::Hello _theirs;
    protocol::Link _link;
    fuzz::PeerState _peer;
    bool _closed = false;
};

}  // namespace
}  // namespace umbriel

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace umbriel;
    wire::Reader input(std::as_bytes(std::span(data, size)));
    const std::uint8_t kind = input.u8();
    Connection(kind & 1 ? wire::Role::Client : wire::Role::Server,
               kind & 2 ? wire::Channel::Bulk : wire::Channel::Control)
        .run(input);
    return 0;
}
