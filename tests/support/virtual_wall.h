#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/net/memory_pump.h"
#include "common/protocol/cluster_client.h"
#include "common/protocol/server_node.h"
#include "common/scene/core_types.h"
#include "common/scene/digest.h"
#include "common/scene/nodes.h"
#include "common/wire/change_codec.h"
#include "common/wire/view_codec.h"

namespace umbriel::test {

inline wire::Hello identityOf(const std::string& name, const TypeRegistry& types) {
    wire::Hello hello;
    hello.name = name;
    hello.build = "test";
    hello.typeSignature = types.signature();
    return hello;
}

// A render server without drawing: it keeps the state that change lists make and answers when it has it.
class VirtualServer {
 public:
    VirtualServer(const std::string& name, const TypeRegistry& types, net::MemoryNetwork& network)
        : VirtualServer(options(name, types), types, network) {}
    VirtualServer(protocol::ServerNodeOptions options, const TypeRegistry& types, net::MemoryNetwork& network)
        : node(std::move(options), network.now()), _network(network), scene(types, _ids) {
        network.add(node, [this] { turn(); });
    }

    static protocol::ServerNodeOptions options(const std::string& name, const TypeRegistry& types) {
        protocol::ServerNodeOptions options;
        options.identity = identityOf(name, types);
        return options;
    }

    protocol::ServerNode node;
    std::vector<std::string> clients;    // whose sessions started
    std::vector<std::string> unreachable;  // why the client it dials has no session for it
    std::vector<std::string> endings;    // reasons of sessions that ended
    std::vector<std::uint64_t> swapped;  // frames shown
    std::uint64_t lastDigest = 0;
    std::uint64_t blobsReceived = 0;
    std::vector<TileAssignment> tiles;
    std::function<void(std::uint64_t)> whenSwapped;
    bool stalled = false;  // draws nothing, yet its network lives
    std::uint64_t corruptDigestBy = 0;
    std::vector<protocol::server_event::JobOffered> jobs;

 private:
    void turn() {
        namespace event = protocol::server_event;
        while (auto next = node.nextEvent()) {
            if (auto* started = std::get_if<event::SessionStarted>(&*next)) {
                clients.push_back(started->client);
                _frames.clear();
            } else if (auto* ended = std::get_if<event::SessionEnded>(&*next)) {
                endings.push_back(ended->reason);
                _frames.clear();
            } else if (auto* refused = std::get_if<event::ClientUnreachable>(&*next)) {
                unreachable.push_back(refused->reason.message);
            } else if (auto* assigned = std::get_if<event::Assigned>(&*next)) {
                tiles = assigned->tiles;
            } else if (auto* frame = std::get_if<event::FrameRequested>(&*next)) {
                _frames.push_back(std::move(*frame));
                _asked = false;
            } else if (auto* swap = std::get_if<event::SwapRequested>(&*next)) {
                swapped.push_back(swap->frame);
                node.reportSwap(swap->frame, _network.now(node));
                if (whenSwapped) whenSwapped(swap->frame);
            } else if (auto* arrived = std::get_if<event::BlobArrived>(&*next)) {
                ++blobsReceived;
                _blobs.put(std::move(arrived->blob));
            } else if (auto* asked = std::get_if<event::DigestAsked>(&*next)) {
                answer(asked->query);
            } else if (std::get_if<event::ExplainAsked>(&*next)) {
                node.sendExplanation("plan of " + std::to_string(swapped.size()));
            } else if (auto* job = std::get_if<event::JobOffered>(&*next)) {
                jobs.push_back(std::move(*job));
            }
        }
        if (!stalled && !_frames.empty()) draw();
    }

    void draw() {
        auto& frame = _frames.front();
        std::vector<wire::BlobRef> missing;
        for (const auto& part : frame.changes) {
            const auto refs = wire::blobsReferenced(part);
            if (!refs) return node.endSession(refs.error().message);
            for (const auto& ref : *refs)
                if (!_blobs.find(ref.hash)) missing.push_back(ref);
        }
        if (!missing.empty()) {
            if (!std::exchange(_asked, true)) node.wantBlobs(missing);
            return;
        }
        const auto follow = [&] {
            const ChangeList list = scene.commit();
            digest.update(list, scene);
        };
        if (frame.fromNothing) {
            RawEdit edit(scene);
            for (const ContainerId id : scene.ids()) edit.destroy(id);
            follow();
        }
        for (const auto& part : frame.changes)
            if (const auto done = wire::applyChanges(part, scene, _blobs); !done)
                return node.endSession(done.error().message);
        follow();
        lastDigest = digest.total();
        wire::Ready ready;
        ready.digest = lastDigest + corruptDigestBy;
        ready.triangles = 12;
        node.sendReady(frame.number, ready);
        if (frame.wantPixels) {
            std::vector<TilePixels> pixels;
            for (const auto& tile : tiles)
                pixels.push_back({tile,
                                  {{Layer::Colour, "colour", 4, ComponentType::Float,
                                    std::vector<std::byte>(static_cast<std::size_t>(tile.pixels.area()) * 16,
                                                           static_cast<std::byte>(tile.tile))}}});
            node.sendTiles(frame.number, std::move(pixels));
        }
        _frames.pop_front();
    }

    void answer(const wire::DigestQuery& query) {
        wire::DigestReply reply;
        for (const auto& [id, value] : digest.containers())
            if (!query.container && id > query.after) reply.digests.emplace_back(id.value, value);
        node.sendDigests(reply);
    }

    net::MemoryNetwork& _network;
    IdSource _ids;

 public:
    Aspect scene;
    StateDigest digest;

 private:
    wire::BlobStore _blobs;
    std::deque<protocol::server_event::FrameRequested> _frames;
    bool _asked = false;
};

// A client with its scene.
class VirtualClient {
 public:
    VirtualClient(protocol::ClusterClientOptions options, const TypeRegistry& types, net::MemoryNetwork& network)
        : scene(types, ids), client(std::move(options), network.now()), _network(network) {
        network.add(client);
    }

    static protocol::ClusterClientOptions options(const std::string& name, const TypeRegistry& types,
                                                  const std::vector<std::string>& servers, std::uint64_t token = 1) {
        protocol::ClusterClientOptions options;
        options.identity = identityOf(name, types);
        options.token = {token, token};
        options.wall = {static_cast<int>(servers.size()) * 10, 10};
        for (std::size_t i = 0; i < servers.size(); ++i)
            options.servers.push_back(
                {servers[i],
                 servers[i],
                 7420,
                 {{static_cast<std::uint32_t>(i), {static_cast<int>(i) * 10, 0, 10, 10}, Eye::Mono}}});
        return options;
    }

    void begin(bool wantPixels = false) {
        ChangeList changes = scene.commit();
        if (frame == 0) changes = scene.snapshot();
        digest.update(changes, scene);
        wire::EncodeOptions encoding;
        encoding.maxPartBytes = 128 * 1024;
        auto encoded = wire::encodeChanges(changes, scene, encoding);
        protocol::OutgoingFrame outgoing;
        outgoing.fromNothing = frame == 0;
        outgoing.number = ++frame;
        outgoing.wantPixels = wantPixels;
        outgoing.views = wire::encodeViews(views);
        outgoing.changes = std::move(encoded.parts);
        for (auto& blob : encoded.blobs) outgoing.blobs.emplace(blob.ref.hash, std::move(blob.data));
        outgoing.digest = digest.total();
        if (frame > 1 && client.wantsSnapshot()) {
            auto whole = wire::encodeChanges(scene.snapshot(), scene, encoding);
            outgoing.snapshot.emplace();
            outgoing.snapshot->parts = std::move(whole.parts);
            for (auto& blob : whole.blobs) outgoing.snapshot->blobs.emplace(blob.ref.hash, std::move(blob.data));
            ++snapshots;
        }
        client.beginFrame(std::move(outgoing), _network.now());
        _network.poke(client);
    }

    // True when nothing is under way any more; an error counts.
    bool settle(Duration limit = std::chrono::seconds(20)) {
        return _network.runUntil([&] { return !client.isBusy(); }, limit);
    }

    std::string errorText() const { return client.error() ? client.error()->message : std::string(); }

    IdSource ids;
    Aspect scene;
    StateDigest digest;
    WallViews views;
    std::uint64_t frame = 0;
    int snapshots = 0;  // encoded for servers that joined
    protocol::ClusterClient client;

 private:
    net::MemoryNetwork& _network;
};

}  // namespace umbriel::test
