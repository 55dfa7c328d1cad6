// Writes the fuzzers' seeds: real encodings of everything that travels, small ones. The same bytes on every run.
// Usage: fuzz_corpus FOLDER

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "common/scene/core_types.h"
#include "common/visibility/bake_job.h"
#include "common/wire/change_codec.h"
#include "common/wire/view_codec.h"
#include "tests/fuzz/peer_script.h"
#include "tests/support/random_scene.h"

namespace umbriel {
namespace {

using fuzz::PeerOp;
using wire::Bytes;
using wire::MessageType;

class Corpus {
 public:
    explicit Corpus(std::filesystem::path folder) : _folder(std::move(folder)) {}
    void add(const std::string& target, const std::string& name, const Bytes& bytes) {
        std::filesystem::create_directories(_folder / target);
        std::ofstream file(_folder / target / name, std::ios::binary);
        file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
        if (!file) std::fprintf(stderr, "fuzz_corpus: %s/%s cannot be written\n", target.c_str(), name.c_str());
    }

 private:
    std::filesystem::path _folder;
};

struct Payload {
    MessageType type;
    Bytes bytes;
};

// No field is what it starts with: a mutation of any one of them finds the others readable.
ShadowFit someFit(std::uint64_t light, ShadowMode mode, ShadowShape shape, std::uint32_t part) {
    ShadowFit fit;
    fit.light = {light};
    fit.mode = mode;
    fit.shape = shape;
    fit.part = part;
    fit.mapSize = 512;
    fit.perspective = shape != ShadowShape::Single;
    fit.worldFromLight[0][1] = 0.25;
    fit.positionWorld = {1.0, 2.0, 3.0};
    fit.clipFromWorld[3][0] = -0.5;
    fit.texelSize = 0.125;
    fit.depthRange = 40.0;
    fit.constantBias = 0.5f;
    fit.slopeBias = 1.5f;
    fit.normalOffset = 0.55f;
    fit.filter = {3.0f, 0.1f, 4, 6, 5, 0.2f, 24.0f, true, true, 16};
    fit.planeWorld = {0.0, 1.0, 0.0, -2.0};
    fit.blobSize = 1.25f;
    fit.casters = shape == ShadowShape::Single ? ShadowCasters::Moving : ShadowCasters::Fixed;
    fit.layer = 2;
    return fit;
}

WallViews someViews() {
    WallViews views;
    views.wall = {64, 32};
    views.tiles = TileMode::Exact;
    views.samples = 4;
    views.layers = static_cast<std::uint32_t>(Layer::Colour) | static_cast<std::uint32_t>(Layer::LightFactors);
    views.colourPrecision = ColourPrecision::Half;
    views.views.resize(2);
    for (View& view : views.views) view.region = {0, 0, 64, 32};
    views.views[0].fits.push_back(someFit(3, ShadowMode::PercentageCloserSoft, ShadowShape::Single, 0));
    views.views[1].viewport = {9};
    views.views[1].eye = Eye::Right;
    views.views[1].orthographic = true;
    return views;
}

// A map of every shape, and modules that have none.
WallViews viewsOfAllShapes() {
    WallViews views = someViews();
    views.colourPrecision = ColourPrecision::Byte;
    views.views[1].fits = {someFit(4, ShadowMode::DualParaboloid, ShadowShape::Hemisphere, 1),
                           someFit(5, ShadowMode::Cube, ShadowShape::CubeFace, 5),
                           someFit(6, ShadowMode::VolumeZFail, ShadowShape::Single, 0),
                           someFit(7, ShadowMode::LightMap, ShadowShape::Single, 0)};
    views.views.emplace_back();
    views.views[2].region = {0, 0, 64, 32};
    views.views[2].unwrapped = true;
    return views;
}

// Two nodes with a transform and a field that becomes a blob.
wire::EncodedChanges someChanges(const TypeRegistry& types) {
    IdSource ids;
    Aspect scene(types, ids);
    const auto node = scene.create<Node>("wheel");
    const auto transform = scene.create<Transform>();
    const auto geometry = scene.create<Geometry>();
    scene.edit(node).set<&Node::core>(geometry);
    scene.edit(transform).set<&Transform::translation>({1.0, 2.0, 3.0});
    scene.edit(geometry).assign<&Geometry::positions>(std::vector<glm::vec3>(40, glm::vec3(1)));
    wire::EncodeOptions options;
    options.blobThreshold = 256;
    return wire::encodeChanges(scene.commit(), scene, options);
}

std::vector<Payload> everyMessage(const TypeRegistry& types) {
    std::vector<Payload> all;
    const auto add = [&](const auto& message) {
        all.push_back({std::decay_t<decltype(message)>::kType, wire::encode(message)});
    };
    const Bytes some(20, std::byte{7});
    const Bytes views = wire::encodeViews(someViews());
    const auto changes = someChanges(types);
    wire::Hello hello;
    hello.name = "left";
    hello.build = "0.1.0";
    hello.wantedName = "wall";
    hello.token = {5, 6};
    hello.epoch = 3;
    hello.typeSignature = types.signature();
    hello.capabilities = hello.needs = wire::kKnownCapabilities;
    hello.glRenderer = "llvmpipe";
    hello.glVersion = "4.5";
    hello.cpu = "x86";
    add(hello);
    add(wire::Welcome{});
    add(wire::Refuse{"no"});
    add(wire::Heartbeat{7'000, true, wire::Heartbeat::Echo{5'000, 6'000}, {{1, 4'000}, {2, 4'500}}});
    add(wire::Goodbye{"the client has finished"});
    add(wire::Assign{{64, 32}, {{0, {0, 0, 32, 32}, Eye::Mono}, {1, {32, 0, 32, 32}, Eye::Left}}});
    add(wire::Changes{changes.parts.front()});
    wire::Frame frame;
    frame.number = 1;
    frame.wantPixels = frame.wantCost = frame.fromNothing = true;
    frame.time = 0.5;
    frame.views = views;
    frame.changes = changes.parts.front();
    add(frame);
    wire::Ready ready;
    ready.frame = 1;
    ready.drawMilliseconds = 1.25;
    ready.triangles = 300;
    ready.nearestDepth = 1.5f;
    ready.farthestDepth = 20.0f;
    ready.shadowTriangles = 200;
    ready.cost = wire::FrameCost{2.5, 0.5, 1 << 20};
    add(ready);
    add(wire::Swap{1});
    add(wire::Failed{1, "no memory left"});
    add(wire::BlobWanted{{changes.blobs.front().ref.hash, {1, 1}}});
    wire::BlobData blob;
    blob.hash = changes.blobs.front().ref.hash;
    blob.total = 480;
    blob.bytes = some;
    add(blob);
    wire::TileData tile;
    tile.frame = 7;
    tile.layerCount = 1;
    tile.name = "colour";
    tile.total = 20;
    tile.bytes = some;
    add(tile);
    add(wire::DigestQuery{{5}, {}});
    add(wire::DigestReply{true, {{1, 2}, {3, 4}}});
    add(wire::Explain{});
    add(wire::ExplainReply{"a plan"});
    wire::JobOffer offer;
    offer.job = 1;
    offer.attempt = 1;
    offer.leaseMilliseconds = 3'000;
    offer.kind = "bake";
    offer.payload = some;
    offer.blobs = {{{1, 2}, 12, 24}};
    add(offer);
    add(wire::JobLease{1, 1, 0.5f});
    add(wire::JobCancel{1, 1});
    add(wire::JobDone{1, 1, wire::JobStatus::Done, "", {1, 2}, 20, 5});
    return all;
}

// A peer's commands (peer_script.h).
class Script {
 public:
    explicit Script(std::uint8_t kind) { _writer.u8(kind); }
    Script(const Script&) = delete;
    Script& operator=(const Script&) = delete;
    Script& plain(PeerOp op, std::uint8_t argument = 0, std::size_t pieceSize = 0) {
        _writer.u8(static_cast<std::uint8_t>(static_cast<std::size_t>(op) | pieceSize << 3));
        _writer.u8(argument);
        return *this;
    }
    Script& time(std::uint16_t milliseconds) {
        plain(PeerOp::Time);
        _writer.u16(milliseconds);
        return *this;
    }
    Script& message(const Payload& payload, std::size_t pieceSize = 0) {
        plain(PeerOp::Message, static_cast<std::uint8_t>(payload.type), pieceSize);
        _writer.u16(static_cast<std::uint16_t>(payload.bytes.size()));
        _writer.raw(payload.bytes);
        return *this;
    }
    template <class Message>
    Script& say(const Message& what, std::size_t pieceSize = 0) {
        return message({Message::kType, wire::encode(what)}, pieceSize);
    }
    Script& spoiled(std::uint8_t type, std::uint16_t how) {
        plain(PeerOp::Spoiled, type);
        _writer.u16(how);
        _writer.u8(0);
        return *this;
    }
    const Bytes& bytes() const { return _bytes; }

 private:
    Bytes _bytes;
    wire::Writer _writer{_bytes};
};

void addLinks(Corpus& corpus, const std::vector<Payload>& messages) {
    for (std::uint8_t kind = 0; kind < 4; ++kind) {
        const bool fromServer = kind & 1;
        const bool bulk = kind & 2;
        Script all(kind);
        all.plain(PeerOp::Hello, 0, 3);
        for (const Payload& payload : messages) {
            const wire::MessageRule& rule = wire::ruleOf(payload.type);
            const bool allowed =
                (fromServer ? rule.fromServer : rule.fromClient) && (bulk ? rule.onBulk : rule.onControl);
            if (allowed && static_cast<std::uint8_t>(payload.type) > 5)
                all.message(payload, static_cast<std::size_t>(payload.type) % 32);
        }
        all.time(1000).message(messages[4]);
        corpus.add("link_fuzz", "session" + std::to_string(kind), all.bytes());
    }
    corpus.add("link_fuzz", "silence", Script(0).plain(PeerOp::Hello).time(900).time(1200).time(5000).bytes());
    corpus.add("link_fuzz", "wrong_epoch", Script(0).plain(PeerOp::Hello).spoiled(9, 0x0105).bytes());
    corpus.add("link_fuzz", "wrong_sequence", Script(1).plain(PeerOp::Hello).spoiled(4, 0x0109).bytes());
    corpus.add("link_fuzz", "reset", Script(1).plain(PeerOp::Hello).plain(PeerOp::Connection).bytes());
    corpus.add("link_fuzz", "refused", Script(1).message(messages[0]).message(messages[2]).bytes());
}

void addSessions(Corpus& corpus, const TypeRegistry& types, const std::vector<Payload>& messages) {
    const auto of = [&](MessageType type) { return messages[static_cast<std::size_t>(type) - 1]; };
    const auto changes = someChanges(types);
    const wire::Blob& blob = changes.blobs.front();
    Bytes content(blob.ref.bytes);
    blob.data.read(0, content);
    wire::BlobData first{blob.ref.hash, blob.ref.bytes, 0, std::span(content).first(100)};
    wire::BlobData rest{blob.ref.hash, blob.ref.bytes, 100, std::span(content).subspan(100)};

    // Server: control is connection 0, bulk connection 1.
    const auto connect = [](Script& script) {
        script.plain(PeerOp::Connection)
            .plain(PeerOp::Hello, 0, 5)
            .plain(PeerOp::Connection)
            .plain(PeerOp::Hello, 0x80);
        script.plain(PeerOp::Connection, 0x40);
    };
    Script drawn(0);
    connect(drawn);
    drawn.message(of(MessageType::Assign)).message(of(MessageType::Frame), 17);
    drawn.plain(PeerOp::Connection, 0x41).say(first).say(rest).plain(PeerOp::Connection, 0x40).plain(PeerOp::Turn);
    drawn.message(of(MessageType::Swap));
    wire::Frame second;
    second.number = 2;
    drawn.say(second)
        .say(wire::Swap{2})
        .message(of(MessageType::DigestQuery))
        .message(of(MessageType::Explain))
        .time(1500);
    corpus.add("session_fuzz", "server_frames", drawn.bytes());
    Script parts(0);
    connect(parts);
    parts.message(of(MessageType::Assign)).message(of(MessageType::Changes)).message(of(MessageType::Frame));
    corpus.add("session_fuzz", "server_parts", parts.bytes());
    Script jobs(0);
    connect(jobs);
    jobs.message(of(MessageType::JobOffer)).message(of(MessageType::JobCancel)).message(of(MessageType::BlobWanted));
    corpus.add("session_fuzz", "server_jobs", jobs.bytes());
    Script fenced(0);
    connect(fenced);
    fenced.plain(PeerOp::Connection).plain(PeerOp::Hello, 2).plain(PeerOp::Connection).plain(PeerOp::Hello, 0x82);
    corpus.add("session_fuzz", "server_fenced", fenced.bytes());

    // Client: it dials left (control 0, bulk 1); right dials it (control 2, bulk 3).
    const auto join = [](Script& script) {
        script.plain(PeerOp::Hello).plain(PeerOp::Hello);
        script.plain(PeerOp::Connection).plain(PeerOp::Hello).plain(PeerOp::Connection).plain(PeerOp::Hello, 0x80);
    };
    wire::Ready ready;
    ready.frame = 1;
    wire::TileData tile;
    const Bytes pixels(64);
    tile.frame = 1;
    tile.layerCount = 1;
    tile.name = "colour";
    tile.total = 64;
    tile.bytes = pixels;
    Script frame(1);
    join(frame);
    frame.plain(PeerOp::Turn, 6).plain(PeerOp::Connection, 0x40).say(wire::BlobWanted{{{1, 1}}}).say(ready);
    frame.plain(PeerOp::Connection, 0x42).say(ready, 9).plain(PeerOp::Connection, 0x41).say(tile);
    tile.tile = 1;
    frame.plain(PeerOp::Connection, 0x43).say(tile).plain(PeerOp::Turn, 2);
    corpus.add("session_fuzz", "client_frame", frame.bytes());
    // The same under the other policies, and with overlapping frames.
    for (const std::uint8_t kind : {3, 5, 9, 11, 13}) {
        Bytes other = frame.bytes();
        other[0] = std::byte{kind};
        corpus.add("session_fuzz", "client_frame" + std::to_string(kind), other);
    }
    // A client with work: the server takes it, asks for what it needs, and the result is fetched.
    const MultiStorage needed = [] {
        MultiStorage content(4);
        content.resize(100);
        return content;
    }();
    MultiStorage result(1);
    result.resize(20);
    const Bytes resultBytes(20);
    Script work(33);
    join(work);
    work.plain(PeerOp::Connection, 0x40)
        .say(wire::BlobWanted{{wire::hashOfBlob(needed)}})
        .say(wire::JobLease{1, 1, 0.5f})
        .say(wire::JobDone{1, 1, wire::JobStatus::Done, "", wire::hashOfBlob(result), 20, 5})
        .plain(PeerOp::Connection, 0x41)
        .say(wire::BlobData{wire::hashOfBlob(result), 20, 0, std::span(resultBytes).first(7)})
        .say(wire::BlobData{wire::hashOfBlob(result), 20, 7, std::span(resultBytes).subspan(7)});
    work.plain(PeerOp::Connection, 0x42).say(wire::JobDone{1, 1, wire::JobStatus::Failed, "no memory", {}, 0, 0});
    corpus.add("session_fuzz", "client_jobs", work.bytes());
    // Servers that say when they showed what.
    Script shown(1);
    join(shown);
    shown.plain(PeerOp::Turn, 2).plain(PeerOp::Connection, 0x40).say(ready).plain(PeerOp::Connection, 0x42).say(ready);
    for (std::int64_t second = 1; second < 4; ++second)
        for (const std::uint8_t control : {0x40, 0x42}) {
            const std::int64_t now = second * 1'000'000'000;
            shown.plain(PeerOp::Connection, control).time(500);
            shown.say(wire::Heartbeat{now, true, wire::Heartbeat::Echo{now - 500'000'000, now}, {{1, now}}});
        }
    corpus.add("session_fuzz", "client_swaps", shown.bytes());
    Script questions(1);
    join(questions);
    questions.plain(PeerOp::Turn, 1)
        .plain(PeerOp::Connection, 0x40)
        .message(of(MessageType::DigestReply))
        .plain(PeerOp::Turn, 0);
    questions.message(of(MessageType::ExplainReply))
        .plain(PeerOp::Connection, 0x42)
        .message(of(MessageType::ExplainReply));
    corpus.add("session_fuzz", "client_questions", questions.bytes());
    Script failed(1);
    join(failed);
    failed.plain(PeerOp::Turn, 2).plain(PeerOp::Connection, 0x40).message(of(MessageType::Failed));
    corpus.add("session_fuzz", "client_failed", failed.bytes());
}

void addChanges(Corpus& corpus) {
    TypeRegistry types;
    registerCoreTypes(types);
    types.add<test::EveryKind>();
    {
        // Every type and every field of it, some types a part.
        IdSource ids;
        Aspect scene(types, ids);
        scene.create<Node>("there already");
        scene.create<test::EveryKind>();
        scene.commit();
        test::RandomEditor(scene).fillAll(24);
        wire::EncodeOptions options;
        options.maxPartBytes = 1024;
        const auto encoded = wire::encodeChanges(scene.commit(), scene, options);
        for (std::size_t i = 0; i < encoded.parts.size(); ++i)
            corpus.add("change_list_fuzz", "every_type_" + std::to_string(i), encoded.parts[i]);
    }
    for (std::uint64_t seed = 0; seed < 24; ++seed) {
        IdSource ids;
        Aspect scene(types, ids);
        // What the fuzzer's aspect has already, so that changes and destructions find something.
        scene.create<Node>("there already");
        scene.create<test::EveryKind>();
        scene.commit();
        test::RandomEditor editor(scene);
        editor.grow(seed % 4, seed);
        test::Random random(seed);
        for (int i = 0; i < 8; ++i) editor.step(random.next());
        wire::EncodeOptions options;
        options.maxPartBytes = seed % 3 == 0 ? 512 : 2048;
        if (seed % 2 == 0) options.blobThreshold = 64;
        const auto encoded = wire::encodeChanges(scene.commit(), scene, options);
        for (std::size_t i = 0; i < std::min<std::size_t>(encoded.parts.size(), 2); ++i)
            corpus.add("change_list_fuzz", "edits" + std::to_string(seed) + "_" + std::to_string(i), encoded.parts[i]);
    }
}

void addBlobs(Corpus& corpus) {
    test::Random random(1);
    for (const int flags : {0x83, 0x81, 0x82, 0x80}) {
        Bytes bytes;
        wire::Writer writer(bytes);
        writer.u8(static_cast<std::uint8_t>(flags));
        writer.u16(12);
        writer.u32(240);
        writer.u16(static_cast<std::uint16_t>(flags & 1 ? 7 : 100));
        writer.raw(random.bytes(240));
        corpus.add("blob_fuzz", "assemble" + std::to_string(flags & 3), bytes);
    }
    for (const std::size_t step : {40u, 120u}) {
        Bytes bytes;
        wire::Writer writer(bytes);
        writer.u8(0);
        writer.u16(120);
        writer.raw(random.bytes(120));
        writer.u8(3);  // elements of 4 bytes
        for (std::size_t at = 0; at < 120; at += step) {
            writer.u8(7);
            writer.u16(static_cast<std::uint16_t>(step));
        }
        corpus.add("blob_fuzz", "receive" + std::to_string(step), bytes);
    }
    Bytes tiles;
    wire::Writer writer(tiles);
    writer.u8(0x40);
    for (const std::uint32_t index : {0u, 5u}) {
        wire::TileData data;
        const Bytes pixels(index == 0 ? 96 : 64);
        data.frame = 7;
        data.tile = index;
        data.layerCount = 1;
        data.name = "colour";
        data.components = index == 0 ? ComponentType::Float : ComponentType::Half;
        data.total = pixels.size();
        for (const std::size_t half : {0u, 1u}) {
            data.offset = half * pixels.size() / 2;
            data.bytes = std::span(pixels).subspan(data.offset, pixels.size() / 2);
            const Bytes payload = wire::encode(data);
            writer.u16(static_cast<std::uint16_t>(payload.size()));
            writer.raw(payload);
        }
    }
    corpus.add("blob_fuzz", "tiles", tiles);
}

void addAnswers(Corpus& corpus) {
    const auto behindLength = [](wire::Writer& writer, const Bytes& payload) {
        writer.u8(static_cast<std::uint8_t>(payload.size()));
        writer.raw(payload);
    };
    Bytes clocks;
    wire::Writer writer(clocks);
    writer.u8(1);
    for (std::int64_t i = 1; i < 4; ++i) {
        wire::Heartbeat heartbeat;
        heartbeat.sent = 5'000'000 * i;
        heartbeat.echo = wire::Heartbeat::Echo{1'000 * i, 4'900'000 * i};
        heartbeat.swaps.push_back({static_cast<std::uint64_t>(i), 5'100'000 * i});
        writer.u16(2'000);
        behindLength(writer, wire::encode(heartbeat));
    }
    corpus.add("answers_fuzz", "clocks", clocks);
    Bytes digests;
    wire::Writer pages(digests);
    pages.u8(0);
    pages.u8(1);
    pages.raw(Bytes{std::byte{1}, std::byte{1}, std::byte{0}});  // two containers as they are, then others
    behindLength(pages, wire::encode(wire::DigestReply{false, {{3, 5}, {4, 6}}}));
    pages.u8(0);
    behindLength(pages, wire::encode(wire::DigestReply{false, {{0, 5}}}));
    corpus.add("answers_fuzz", "digests", digests);
}

void addBakeJobs(Corpus& corpus) {
    const auto add = [&](std::uint8_t kind, const char* name, const visibility::Bytes& payload) {
        Bytes bytes{static_cast<std::byte>(kind)};
        bytes.insert(bytes.end(), payload.begin(), payload.end());
        corpus.add("bake_job_fuzz", name, bytes);
    };
    visibility::BakeJob job;
    job.settings.guard = trace::Guard::FastFan;
    job.settings.farShare = 0.25;
    job.settings.environment = {64, 32};
    job.meshHash = {1, 2};
    job.directionHash = {3, 4};
    job.firstRow = 2048;
    job.rowCount = 16;
    for (const auto kind : {visibility::MappingKind::HemiSphere, visibility::MappingKind::SinglePlane,
                            visibility::MappingKind::HemiCube, visibility::MappingKind::Fibonacci}) {
        job.settings.mapping = {kind, 16, kind == visibility::MappingKind::SinglePlane ? 1.5 : 0.0};
        add(1, ("job" + std::to_string(static_cast<int>(kind))).c_str(), visibility::encodeBakeJob(job));
    }
    add(0, "readiness", visibility::encodeReadiness({"llvmpipe, 128 bits", 2, {1, 2}, {3, 4}}));
}

}  // namespace
}  // namespace umbriel

int main(int argc, char** argv) {
    using namespace umbriel;
    if (argc != 2) {
        std::fprintf(stderr, "usage: fuzz_corpus FOLDER\n");
        return 2;
    }
    Corpus corpus(argv[1]);
    TypeRegistry types;
    registerCoreTypes(types);
    const std::vector<Payload> messages = everyMessage(types);
    for (const Payload& payload : messages) {
        Bytes bytes{static_cast<std::byte>(payload.type)};
        bytes.insert(bytes.end(), payload.bytes.begin(), payload.bytes.end());
        corpus.add("messages_fuzz", std::string(wire::ruleOf(payload.type).name), bytes);
    }
    corpus.add("views_fuzz", "none", wire::encodeViews({}));
    corpus.add("views_fuzz", "two", wire::encodeViews(someViews()));
    corpus.add("views_fuzz", "all_shapes", wire::encodeViews(viewsOfAllShapes()));
    addChanges(corpus);
    addBlobs(corpus);
    addLinks(corpus, messages);
    addSessions(corpus, types, messages);
    addAnswers(corpus);
    addBakeJobs(corpus);
    return 0;
}
