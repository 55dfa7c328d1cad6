// How fast changes are encoded, sent and applied, against copying and sending the same bytes.
// Arguments: --json, --only transforms|geometry|join|others.

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <memory>
#include <thread>

#include "client/session/cluster.h"
#include "client/session/server_process.h"
#include "common/scene/core_types.h"
#include "common/scene/digest.h"
#include "common/scene/nodes.h"
#include "common/wire/change_codec.h"
#include "tests/bench/measure.h"
#include "tests/bench/plain_socket.h"
#include "tests/support/reserved_port.h"
#include "tests/support/temporary_folder.h"

namespace umbriel {
namespace {

constexpr int kRounds = 5;
constexpr std::size_t kTransforms = 10'000;
constexpr std::size_t kGeometries = 10;
constexpr std::size_t kVertices = 833'334;  // 12 bytes each: 10 geometries are 100 MB
const std::filesystem::path kPrograms = UMBRIEL_BIN_DIR;

// Bytes to a process that only takes them.
class Floor {
 public:
    explicit Floor(const std::string& answer, bool unpaced = false)
        : _process(bench::need(ServerProcess::start(kPrograms / "bench_server", {"--answer", answer}, {}))),
          _socket(bench::PlainSocket::dial(bench::need(_process.waitForPort(std::chrono::seconds(60))), unpaced)) {}
    double secondsToSend(std::span<const std::byte> bytes) {
        return bench::secondsOf([&] {
            const std::uint64_t size = bytes.size();
            _socket.write(std::as_bytes(std::span(&size, 1)));
            _socket.write(bytes);
            std::byte answer;
            if (!_socket.read(std::span(&answer, 1))) std::exit(1);
        });
    }

 private:
    ServerProcess _process;
    bench::PlainSocket _socket;
};

void receive(const wire::EncodedChanges& encoded, Aspect& into, wire::BlobStore& blobs) {
    for (const wire::Bytes& part : encoded.parts)
        if (const auto done = wire::applyChanges(part, into, blobs); !done) {
            std::fprintf(stderr, "bench_rates: %s\n", done.error().message.c_str());
            std::exit(1);
        }
}

void transforms(const bench::Report& report, const TypeRegistry& types, Floor& floor) {
    IdSource ids;
    IdSource otherIds;
    Aspect client(types, ids);
    Aspect server(types, otherIds);
    wire::BlobStore blobs;
    std::vector<Ref<Transform>> all;
    for (std::size_t i = 0; i < kTransforms; ++i) all.push_back(client.create<Transform>());
    receive(wire::encodeChanges(client.commit(), client), server, blobs);
    server.commit();
    int turn = 0;
    ChangeList changes;
    wire::EncodedChanges encoded;
    wire::Bytes joined;
    wire::Bytes copy;
    StateDigest digest;
    digest.update(client.snapshot(), client);
    const auto seconds = bench::interleaved(
        4 * kRounds,
        [&] {  // what the application does, and what makes the list
            const double value = ++turn;
            return bench::secondsOf([&] {
                for (const auto& one : all)
                    client.edit(one)
                        .set<&Transform::translation>({value, 2.0, 3.0})
                        .set<&Transform::linear>(glm::mat3(float(value)));
                changes = client.commit();
            });
        },
        [&] { return bench::secondsOf([&] { encoded = wire::encodeChanges(changes, client); }); },
        [&] { return bench::secondsOf([&] { receive(encoded, server, blobs); }); },
        [&] { return bench::secondsOf([&] { server.commit(); }); },
        [&] { return bench::secondsOf([&] { digest.update(changes, client); }); },
        [&] {
            joined.clear();
            for (const wire::Bytes& part : encoded.parts) joined.insert(joined.end(), part.begin(), part.end());
            copy.resize(joined.size());
            return bench::secondsOf([&] { std::memcpy(copy.data(), joined.data(), joined.size()); });
        },
        [&] { return floor.secondsToSend(joined); });
    const char* const names[] = {"edit and commit",
                                 "encode",
                                 "apply",
                                 "commit on the server",
                                 "digest",
                                 "memcpy of the same bytes",
                                 "loopback TCP of the same bytes"};
    for (std::size_t i = 0; i < seconds.size(); ++i)
        report.figure(fmt::format("10 000 transforms: {}", names[i]), seconds[i] * 1e3, "ms");
    report.figure("10 000 transforms: bytes each", static_cast<double>(joined.size()) / kTransforms, "bytes", 72);
    report.figure("10 000 transforms: encode and apply / loopback TCP", seconds.ratio({1, 2}, 6), "x");
    report.figure("10 000 transforms: encode and apply / memcpy", seconds.ratio({1, 2}, 5), "x");
}

void fill(Aspect& scene, float value) {
    for (std::size_t i = 0; i < kGeometries; ++i) {
        std::vector<glm::vec3> positions(kVertices, glm::vec3(value));
        for (std::size_t k = 0; k < kVertices; ++k) positions[k].y = static_cast<float>(k * (i + 1));
        scene.edit(scene.create<Geometry>()).assign<&Geometry::positions>(positions);
    }
}

void geometry(const bench::Report& report, const TypeRegistry& types, Floor& floor) {
    const wire::Bytes same(kGeometries * kVertices * 12, std::byte{1});
    wire::Bytes copy(same.size());
    wire::EncodedChanges encoded;
    std::unique_ptr<Aspect> client;
    IdSource ids;
    const auto encodeWith = [&](std::size_t threshold) {
        client = std::make_unique<Aspect>(types, ids);
        fill(*client, 1.0f);
        const ChangeList changes = client->commit();
        wire::EncodeOptions options;
        options.blobThreshold = threshold;
        return bench::secondsOf([&] { encoded = wire::encodeChanges(changes, *client, options); });
    };
    const auto apply = [&] {
        IdSource otherIds;
        Aspect server(types, otherIds);
        wire::BlobStore blobs;
        return bench::secondsOf([&] {
            // What arrives as bytes: blobs in pieces, as over the wire.
            for (const wire::Blob& blob : encoded.blobs) {
                wire::BlobAssembler assembler(blob.ref, blob.ref.bytes);
                for (std::size_t i = 0; i < blob.data.chunkCount(); ++i) (void)assembler.add(blob.data.chunk(i));
                blobs.put(bench::need(assembler.finish()));
            }
            receive(encoded, server, blobs);
        });
    };
    const auto seconds = bench::interleaved(
        kRounds, [&] { return encodeWith(~std::size_t{0}); }, [&] { return apply(); },
        [&] { return encodeWith(32 * 1024); }, [&] { return apply(); },
        [&] { return bench::secondsOf([&] { std::memcpy(copy.data(), same.data(), same.size()); }); },
        [&] { return floor.secondsToSend(same); });
    const char* const names[] = {"encode, inline",
                                 "apply, inline",
                                 "encode, as blobs (their hashes)",
                                 "apply, as blobs (pieces, hash, assignment)",
                                 "memcpy",
                                 "loopback TCP"};
    for (std::size_t i = 0; i < seconds.size(); ++i)
        report.figure(fmt::format("100 MB of geometry: {}", names[i]), seconds[i] * 1e3, "ms");
    report.figure("100 MB of geometry: encode and apply blobs / loopback TCP", seconds.ratio({2, 3}, 5), "x");
    report.figure("100 MB of geometry: encode and apply blobs / memcpy", seconds.ratio({2, 3}, 4), "x");
}

WallViews viewsOfTwo() {
    WallViews views;
    views.wall = {32, 16};
    views.views.emplace_back();
    views.views.back().region = {0, 0, 32, 16};
    return views;
}

ServerProcess startServer(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--answer", "draw"});
    return bench::need(ServerProcess::start(kPrograms / "bench_server", std::move(arguments), {}));
}

// A server's first frame: snapshot, blobs over the bulk connection, digest, ready. cache: where it keeps blobs; empty:
// nowhere.
struct Joined {
    double connecting = 0.0;
    double frame = 0.0;
    std::uint64_t bytes = 0;
};
Joined joinOnce(Aspect& scene, const TypeRegistry& types, const std::string& cache, double stay = 0.0) {
    ClusterOptions options;
    options.serverProgram = kPrograms / "bench_server";
    options.serverArguments = {"--answer", "draw"};
    if (!cache.empty()) options.serverArguments.insert(options.serverArguments.end(), {"--blob-cache", cache});
    std::unique_ptr<Cluster> cluster;
    Joined joined;
    joined.connecting = bench::secondsOf([&] {
        cluster = bench::need(Cluster::connect(options, types, {{0, {0, 0, 32, 16}, Eye::Mono}}));
    });
    joined.frame = bench::secondsOf(
        [&] { joined.bytes = bench::need(cluster->frame(scene, viewsOfTwo(), 0.0, false)).servers[0].bytes; });
    std::this_thread::sleep_for(std::chrono::duration<double>(stay));
    return joined;
}

void join(const bench::Report& report, const TypeRegistry& types, Floor& floor) {
    IdSource ids;
    Aspect scene(types, ids);
    const double filling = bench::secondsOf([&] { fill(scene, 1.0f); });
    const wire::Bytes same(kGeometries * kVertices * 12, std::byte{1});
    Floor unpaced("receive", true);
    Floor keeping("keep", true);
    const test::TemporaryFolder own;
    const auto folder = own.path();
    std::vector<double> connecting;
    std::vector<double> preparing;
    double cachedBytes = 0.0;
    (void)joinOnce(scene, types, folder.string(), 3.0);  // fills the folder
    const auto seconds = bench::interleaved(
        kRounds,
        [&] {
            preparing.push_back(bench::secondsOf([&] {
                StateDigest digest;
                const ChangeList snapshot = scene.snapshot();
                digest.update(snapshot, scene);
                (void)wire::encodeChanges(snapshot, scene);
            }));
            const Joined joined = joinOnce(scene, types, "");
            connecting.push_back(joined.connecting);
            return joined.frame;
        },
        [&] { return floor.secondsToSend(same); },
        [&] {
            const Joined joined = joinOnce(scene, types, folder.string());
            cachedBytes = static_cast<double>(joined.bytes);
            return joined.frame;
        },
        [&] { return keeping.secondsToSend(same); }, [&] { return unpaced.secondsToSend(same); });
    report.figure("join to a 100 MB scene: making it, block hashes included", filling * 1e3, "ms");
    report.figure("join to a 100 MB scene: starting and connecting to a process", bench::median(connecting) * 1e3,
                  "ms");
    report.figure("join to a 100 MB scene: of it, digest and names here", bench::median(preparing) * 1e3, "ms");
    report.figure("join to a 100 MB scene: first frame", seconds[0] * 1e3, "ms");
    report.figure("join to a 100 MB scene: raw transfer", seconds[1] * 1e3, "ms");
    report.figure("join to a 100 MB scene: first frame / raw transfer", seconds.ratio({0}, 1), "x", 1.25);
    report.figure("join to a 100 MB scene: raw transfer, unpaced", seconds[4] * 1e3, "ms");
    report.figure("join to a 100 MB scene: first frame / raw transfer, unpaced", seconds.ratio({0}, 4), "x");
    report.figure("join to a 100 MB scene: raw transfer into fresh memory, unpaced", seconds[3] * 1e3, "ms");
    report.figure("join to a 100 MB scene: first frame / raw transfer into fresh memory, unpaced",
                  seconds.ratio({0}, 3), "x");
    report.figure("join to a 100 MB scene: from its blob cache, bytes sent", cachedBytes, "bytes");
    report.figure("join to a 100 MB scene: from its blob cache, first frame", seconds[2] * 1e3, "ms");
    report.figure("join to a 100 MB scene: from its blob cache / raw transfer", seconds.ratio({2}, 1), "x");
}

// A second server joins while the first one draws: the frame times of the wall before that and meanwhile, in one run.
void others(const bench::Report& report, const TypeRegistry& types, int drawMilliseconds) {
    IdSource ids;
    Aspect scene(types, ids);
    fill(scene, 1.0f);
    const auto wheel = scene.create<Transform>();
    auto first = startServer({"--name", "first", "--draw-ms", std::to_string(drawMilliseconds)});
    const test::ReservedPort free;
    ClusterOptions options;
    options.servers = {{"first", "127.0.0.1", bench::need(first.waitForPort(std::chrono::seconds(60)))},
                       {"second", "127.0.0.1", free.number()}};
    options.policy = FailurePolicy::Degrade;
    options.startIncomplete = true;
    options.connectTimeout = std::chrono::milliseconds(500);
    auto cluster = bench::need(
        Cluster::connect(options, types, {{0, {0, 0, 16, 16}, Eye::Mono}, {1, {16, 0, 16, 16}, Eye::Mono}}));
    double turn = 0.0;
    FrameReport last;
    const auto frame = [&] {
        scene.edit(wheel).set<&Transform::translation>({++turn, 0.0, 0.0});
        return bench::secondsOf([&] { last = bench::need(cluster->frame(scene, viewsOfTwo(), 0.0, false)); });
    };
    frame();
    std::vector<double> before;
    std::vector<double> during;
    std::vector<double> joins;
    int missed = 0;
    for (int round = 0; round < 2 * kRounds; ++round) {
        for (int i = 0; i < 200; ++i) before.push_back(frame());
        auto second = startServer({"--name", "second", "--draw-ms", std::to_string(drawMilliseconds), "--port",
                                   std::to_string(free.number())});
        double start = 0.0;
        for (const double end = bench::secondsNow() + 20.0; bench::secondsNow() < end && last.rejoined.empty();) {
            const double began = bench::secondsNow();
            const double seconds = frame();
            if (start == 0.0 && last.servers[1].bytes > 1000) start = began;
            if (start != 0.0) during.push_back(seconds);
            missed += !last.servers[0].shown;
        }
        joins.push_back(bench::secondsNow() - start);
        last = {};
    }
    const auto percentile = [](std::vector<double> values, double part) {
        std::sort(values.begin(), values.end());
        return values.empty() ? 0.0 : values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
    };
    const std::string name = fmt::format("others, {} ms of drawing, while one joins 100 MB", drawMilliseconds);
    report.figure(name + ": frames meanwhile", static_cast<double>(during.size()), "");
    report.figure(name + ": frames that the first one did not show", missed, "");
    report.figure(name + ": until it is back", bench::median(joins) * 1e3, "ms");
    for (const double part : {0.5, 0.99}) {
        const std::string which = part == 0.5 ? "median" : "p99";
        report.figure(fmt::format("{}: {} frame before", name, which), percentile(before, part) * 1e3, "ms");
        report.figure(fmt::format("{}: {} frame meanwhile", name, which), percentile(during, part) * 1e3, "ms");
        report.figure(fmt::format("{}: {} ratio", name, which), percentile(during, part) / percentile(before, part),
                      "x", part == 0.5 ? 1.2 : 0.0);
    }
}

}  // namespace
}  // namespace umbriel

int main(int argc, char** argv) {
    using namespace umbriel;
    const bench::Report report(bench::hasFlag(argc, argv, "--json"));
    TypeRegistry types;
    registerCoreTypes(types);
    Floor floor("receive");
    const std::string only = bench::option(argc, argv, "--only", "");
    if (only.empty() || only == "transforms") transforms(report, types, floor);
    if (only.empty() || only == "geometry") geometry(report, types, floor);
    if (only.empty() || only == "join") join(report, types, floor);
    for (const int milliseconds : {0, 5, 16})
        if (only.empty() || only == "others") others(report, types, milliseconds);
    return 0;
}
