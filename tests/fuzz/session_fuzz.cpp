// Whole sessions of a render server, and of a client with two servers, whose peers do anything: several connections,
// messages in and out of order, changes and blobs that are applied, frames that are drawn and swapped. Nothing a peer
// does ends the program, and what it can make us keep stays small.

#include <algorithm>
#include <array>
#include <deque>
#include <map>

#include "common/base/assert.h"
#include "common/protocol/cluster_client.h"
#include "common/protocol/server_node.h"
#include "common/scene/core_types.h"
#include "common/scene/digest.h"
#include "common/wire/change_codec.h"
#include "common/wire/view_codec.h"
#include "tests/fuzz/peer_script.h"

namespace umbriel {
namespace {

namespace event = protocol::server_event;
using protocol::Action;
using protocol::ConnectionId;

constexpr std::size_t kMaxConnections = 6;

wire::Hello helloOf(const std::string& name, const TypeRegistry& types) {
    wire::Hello hello;
    hello.name = name;
    hello.build = "fuzz";
    hello.typeSignature = types.signature();
    return hello;
}

// Feeds one endpoint with what its peers do, connection by connection.
class Peers {
 public:
    // theirs: what a well-behaved peer says on a connection that we dialled with this tag (0: that it dialled).
    Peers(protocol::Endpoint& endpoint, std::function<wire::Hello(std::uint64_t tag)> theirs)
        : _endpoint(endpoint), _theirs(std::move(theirs)) {
        actions();
    }

    TimePoint now{};

    void perform(const fuzz::PeerCommand& command) {
        switch (command.op) {
            case fuzz::PeerOp::Time:
                now += std::chrono::milliseconds(command.number);
                _endpoint.advance(now);
                break;
            case fuzz::PeerOp::Connection:
                if (command.argument & 0x80)
                    close();
                else if (command.argument & 0x40)
                    _current = command.argument & 0x3f;
                else if (_connections.size() < kMaxConnections)
                    open(0);
                break;
            case fuzz::PeerOp::Turn:
                break;
            default:
                deliver(command);
        }
        actions();
        write();
    }

 private:
    struct Connection {
        ConnectionId id;
        std::uint64_t tag;
        fuzz::PeerState state;
    };

    Connection* current() { return _connections.empty() ? nullptr : &_connections[_current % _connections.size()]; }

    void open(std::uint64_t tag) {
        _connections.push_back({_nextId++, tag, {1, 0}});
        _current = _connections.size() - 1;
        _endpoint.opened(_connections.back().id, tag, now);
    }

    void close() {
        if (_connections.empty()) return;
        const auto at = _connections.begin() + static_cast<std::ptrdiff_t>(_current % _connections.size());
        const ConnectionId id = at->id;
        _connections.erase(at);
        _endpoint.closed(id, "reset by peer", now);
    }

    void deliver(const fuzz::PeerCommand& command) {
        Connection* connection = current();
        if (!connection) return;
        const ConnectionId id = connection->id;
        wire::Hello hello = _theirs(connection->tag);
        // The peer that dialled chooses what the connection is for: the high bit of the argument.
        if (command.op == fuzz::PeerOp::Hello && connection->tag == 0) {
            if (command.argument & 0x80) hello.channel = wire::Channel::Bulk;
            if (hello.role == wire::Role::Client && (command.argument & 0x7f) != 0)
                hello.epoch = command.argument & 0x7f;
            connection->state.epoch = std::max(1u, hello.epoch);
        }
        const wire::Bytes bytes = fuzz::bytesOf(command, connection->state, hello);
        fuzz::inPieces(bytes, command.pieceSize, [&](std::span<const std::byte> piece) { hand(id, piece); });
    }

    // As a pump does: what has room is put there.
    void hand(ConnectionId id, std::span<const std::byte> bytes) {
        std::array<std::span<std::byte>, 2> places;
        std::size_t placed = 0;
        for (std::size_t i = 0, count = _endpoint.room(id, places); i < count; ++i) {
            const std::size_t size = std::min(places[i].size(), bytes.size() - placed);
            std::copy_n(bytes.data() + placed, size, places[i].data());
            placed += size;
        }
        if (placed > 0) _endpoint.placed(id, placed, now);
        if (placed < bytes.size()) _endpoint.received(id, bytes.subspan(placed), now);
    }

    void actions() {
        while (const auto action = _endpoint.nextAction()) {
            if (action->kind == Action::Kind::Dial) {
                if (_connections.size() < kMaxConnections)
                    open(action->tag);
                else
                    _endpoint.dialFailed(action->tag, failure("connection refused"), now);
                continue;
            }
            for (std::size_t i = 0; i < _connections.size(); ++i)
                if (_connections[i].id == action->connection) {
                    _current = i;
                    close();
                    break;
                }
        }
    }

    // Peers read everything, which lets bulk transfers go on.
    void write() {
        for (std::size_t i = 0; i < _connections.size(); ++i) {
            const ConnectionId id = _connections[i].id;
            protocol::SendQueue* queue = _endpoint.output(id);
            if (!queue || queue->empty()) continue;
            queue->consumed(queue->size());
            _endpoint.written(id, now);
        }
    }

    protocol::Endpoint& _endpoint;
    std::function<wire::Hello(std::uint64_t)> _theirs;
    std::vector<Connection> _connections;
    std::size_t _current = 0;
    ConnectionId _nextId = 1;
};

// A render server whose drawing is applying the changes.
class Server {
 public:
    explicit Server(const TypeRegistry& types) : _scene(types, _ids), node(options(types), {}) {}

    void turn() {
        while (auto next = node.nextEvent()) {
            if (auto* frame = std::get_if<event::FrameRequested>(&*next)) {
                _frames.push_back(std::move(*frame));
                _asked = false;
            } else if (auto* arrived = std::get_if<event::BlobArrived>(&*next)) {
                _blobs.put(std::move(arrived->blob));
            } else if (std::get_if<event::SessionEnded>(&*next)) {
                _frames.clear();
            } else if (std::get_if<event::DigestAsked>(&*next)) {
                node.sendDigests({});
            } else if (std::get_if<event::ExplainAsked>(&*next)) {
                node.sendExplanation("a plan");
            } else if (auto* job = std::get_if<event::JobOffered>(&*next)) {
                wire::JobDone done;
                done.job = job->job;
                done.attempt = job->attempt;
                node.sendJobDone(done, std::move(job->payload));
            }
        }
        UMBRIEL_ASSERT(_frames.size() <= protocol::ServerNode::kMaxFramesUnderWay, "more frames than are allowed");
        if (!_frames.empty()) draw();
    }

 private:
    static protocol::ServerNodeOptions options(const TypeRegistry& types) {
        protocol::ServerNodeOptions options;
        options.identity = helloOf("left", types);
        return options;
    }

    void draw() {
        event::FrameRequested& frame = _frames.front();
        std::vector<wire::BlobRef> missing;
        for (const wire::Bytes& part : frame.changes) {
            const auto refs = wire::blobsReferenced(part);
            if (!refs) return node.endSession(refs.error().message);
            for (const wire::BlobRef& ref : *refs)
                if (!_blobs.find(ref.hash)) missing.push_back(ref);
        }
        if (!missing.empty()) {
            if (!std::exchange(_asked, true)) node.wantBlobs(missing);
            return;
        }
        if (frame.fromNothing)
            for (const ContainerId id : _scene.ids()) RawEdit(_scene).destroy(id);
        _digest.update(_scene.commit(), _scene);
        for (const wire::Bytes& part : frame.changes)
            if (const auto done = wire::applyChanges(part, _scene, _blobs); !done) {
                node.endSession(done.error().message);
                _frames.clear();
                return;
            }
        _digest.update(_scene.commit(), _scene);
        wire::Ready ready;
        ready.digest = _digest.total();
        const std::uint64_t number = frame.number;
        const bool wantPixels = frame.wantPixels;
        _frames.pop_front();
        node.sendReady(number, ready);
        if (wantPixels)
            node.sendTiles(number,
                           {{{0, {0, 0, 2, 2}, Eye::Mono}, {{Layer::Colour, "colour", 4, ComponentType::Float, wire::Bytes(64)}}}});
    }

    IdSource _ids;
    Aspect _scene;
    StateDigest _digest;
    wire::BlobStore _blobs;
    std::deque<event::FrameRequested> _frames;
    bool _asked = false;

 public:
    protocol::ServerNode node;
};

void serverSession(wire::Reader& input, const TypeRegistry& types) {
    Server server(types);
    wire::Hello client = helloOf("desk", types);
    client.role = wire::Role::Client;
    client.epoch = 1;
    client.token = {1, 2};
    Peers peers(server.node, [&](std::uint64_t) { return client; });
    while (input.ok() && !input.atEnd()) {
        peers.perform(fuzz::nextCommand(input));
        server.turn();
    }
}

// A client with a scene of two containers and a blob, drawing frame after frame.
class Client {
 public:
    Client(const TypeRegistry& types, std::uint8_t kind)
        : client(options(types, kind), {}), _overlaps((kind & 8) != 0), _hasWork((kind & 32) != 0) {
        if (!_hasWork) return;
        _content.data.resize(100);
        _content.ref = {wire::hashOfBlob(_content.data), 4, _content.data.byteSize()};
        client.provideBlobs({_content});
    }

    // Offers every session a job and fetches what comes of it, unless that is larger than anything the job could give.
    void work() {
        if (!_hasWork) return;
        using Kind = protocol::JobNews::Kind;
        for (const protocol::JobNews& news : client.takeJobNews()) {
            if (news.kind == Kind::Begun) {
                client.offerJob(news.peer, {1, 1, std::chrono::seconds(2), "bake", {}, {_content.ref}});
            } else if (news.kind == Kind::Done && news.done.resultBytes > 0 && news.done.resultBytes <= 4096) {
                client.fetchResult(news.peer, {news.done.result, 1, news.done.resultBytes});
            } else if (news.kind == Kind::Done) {
                client.cancelJob(news.peer, news.done.job, news.done.attempt);
            } else if (news.kind == Kind::Result) {
                UMBRIEL_ASSERT(wire::hashOfBlob(news.result.data) == news.result.ref.hash,
                               "a result that does not bear its name");
            }
        }
    }

    void turn(std::uint8_t word, TimePoint now) {
        if (client.isBusy() || client.error()) return;
        // Questions are for when no frame is under way.
        switch (_overlaps ? 2 : word % 4) {
            case 0:
                client.beginExplain();
                break;
            case 1:
                client.beginDigestQuery(word / 4 % 2, {});
                break;
            default: {
                protocol::OutgoingFrame frame;
                frame.number = ++_frame;
                frame.fromNothing = _frame == 1;
                frame.wantPixels = (word & 4) != 0;
                frame.views = wire::encodeViews({});
                frame.digest = word & 8;  // a peer can know it
                if (client.wantsSnapshot()) frame.snapshot.emplace();
                if (client.wantsDigests()) frame.digests = std::make_shared<const StateDigest>();
                MultiStorage content(4);
                content.resize(100);
                frame.blobs.emplace(Hash128{1, 1}, content);
                client.beginFrame(std::move(frame), now);
            }
        }
    }

 private:
    static protocol::ClusterClientOptions options(const TypeRegistry& types, std::uint8_t kind) {
        protocol::ClusterClientOptions options;
        options.policy = static_cast<protocol::FailurePolicy>(kind / 2 % 3);
        options.startIncomplete = options.policy != protocol::FailurePolicy::Wait && (kind & 8) != 0;
        options.latency = kind & 8 ? 1 : 0;
        if (kind & 16) options.compareWithin = std::chrono::seconds(1);
        options.historyFrames = 2;  // soon too little for a server that lags: it then needs a snapshot
        options.identity = helloOf("desk", types);
        options.token = {1, 2};
        options.wall = {4, 2};
        options.servers = {{"left", "left", 7420, {{0, {0, 0, 2, 2}, Eye::Mono}}},
                           {"", "", 0, {{1, {2, 0, 2, 2}, Eye::Mono}}}};
        return options;
    }
    std::uint64_t _frame = 0;

 public:
    protocol::ClusterClient client;

 private:
    bool _overlaps;
    bool _hasWork;
    wire::Blob _content{{}, MultiStorage(4)};
};

void clientSession(wire::Reader& input, const TypeRegistry& types, std::uint8_t kind) {
    Client client(types, kind);
    wire::Hello server = helloOf("left", types);
    server.role = wire::Role::Server;
    Peers peers(client.client, [&](std::uint64_t tag) {
        wire::Hello hello = server;
        if (tag == 0) {  // it dials: a bulk connection shows the session's token
            hello.name = "right";
            hello.token = {1, 2};
            hello.epoch = 1;
        }
        return hello;
    });
    while (input.ok() && !input.atEnd()) {
        const fuzz::PeerCommand command = fuzz::nextCommand(input);
        peers.perform(command);
        if (command.op == fuzz::PeerOp::Turn) client.turn(command.argument, peers.now);
        UMBRIEL_ASSERT(!client.client.error() || !client.client.error()->message.empty(), "an end without a reason");
        (void)client.client.waitingFor();
        (void)client.client.takeIncidents();
        (void)client.client.takeFinished();
        client.work();
    }
}

}  // namespace
}  // namespace umbriel

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace umbriel;
    static const TypeRegistry types = [] {
        TypeRegistry all;
        registerCoreTypes(all);
        return all;
    }();
    wire::Reader input(std::as_bytes(std::span(data, size)));
    if (const std::uint8_t kind = input.u8(); kind & 1)
        clientSession(input, types, kind);
    else
        serverSession(input, types);
    return 0;
}
