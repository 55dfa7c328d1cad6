// What a frame's barrier costs, by number of servers (real processes on this machine), an idle scene: against the same
// messages in a plain loop between the same number of processes.
// Arguments: --json, --servers 1,2,4,..., --frames N, --rounds N, --gl-up-to N (servers with OpenGL contexts),
// --only plain|network|draw (one loop for a profiler: no ratios).

#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <sstream>
#include <thread>

#include "client/session/cluster.h"
#include "client/session/server_process.h"
#include "common/net/asio_pump.h"
#include "common/protocol/cluster_client.h"
#include "common/scene/core_types.h"
#include "common/scene/digest.h"
#include "common/scene/nodes.h"
#include "common/wire/view_codec.h"
#include "tests/bench/measure.h"
#include "tests/bench/plain_messages.h"
#include "tests/bench/plain_socket.h"

namespace umbriel {
namespace {

const std::filesystem::path kPrograms = UMBRIEL_BIN_DIR;

std::vector<TileAssignment> row(int count) {
    std::vector<TileAssignment> tiles;
    for (int i = 0; i < count; ++i) tiles.push_back({static_cast<std::uint32_t>(i), {i * 16, 0, 16, 16}, Eye::Mono});
    return tiles;
}

WallViews viewsOf(int servers) {
    WallViews views;
    views.wall = {servers * 16, 16};
    views.views.emplace_back();
    views.views.back().region = {0, 0, servers * 16, 16};
    return views;
}

struct Processes {
    std::vector<ServerProcess> processes;
    std::vector<std::uint16_t> ports;
};

Processes start(const std::string& answer, int count) {
    Processes started;
    for (int i = 0; i < count; ++i)
        started.processes.push_back(bench::need(ServerProcess::start(
            kPrograms / "bench_server", {"--answer", answer, "--name", fmt::format("{}-{}", answer, i)}, {})));
    for (ServerProcess& process : started.processes)
        started.ports.push_back(bench::need(process.waitForPort(std::chrono::seconds(60))));
    return started;
}

// Each returns the median seconds of its frames.
class PlainLoop {
 public:
    explicit PlainLoop(int servers) : _processes(start("plain", servers)) {
        for (const std::uint16_t port : _processes.ports) _peers.push_back(bench::PlainSocket::dial(port));
    }
    double run(int frames) {
        const wire::Bytes frame = bench::plainFrame();
        const wire::Bytes swap = bench::plainSwap();
        wire::Bytes ready = bench::plainReady();
        std::vector<double> seconds;
        for (int i = 0; i < frames; ++i)
            seconds.push_back(bench::secondsOf([&] {
                for (auto& peer : _peers) peer.write(frame);
                for (auto& peer : _peers)
                    if (!peer.read(ready)) std::exit(1);
                for (auto& peer : _peers) peer.write(swap);
            }));
        return bench::median(std::move(seconds));
    }

 private:
    Processes _processes;
    std::vector<bench::PlainSocket> _peers;
};

// The protocol on one network thread here, answered on the network threads there.
class NetworkLoop {
 public:
    NetworkLoop(int servers, const TypeRegistry& types)
        : _processes(start("network", servers)),
          _views(wire::encodeViews(viewsOf(servers))),
          _client(options(servers, types, _processes.ports), SteadyClock().now()),
          _pump(_client, false) {
        _pump.onTurn([this] { turn(); });
        auto connected = _over.emplace().get_future();
        _thread = std::thread([this] { _pump.run(); });
        connected.wait();
    }
    ~NetworkLoop() {
        _pump.stop();
        _thread.join();
    }

    double run(int frames) {
        std::promise<void> over;
        auto isOver = over.get_future();
        _pump.post([this, frames, over = std::make_shared<std::promise<void>>(std::move(over))] {
            _over = std::move(*over);
            _seconds.clear();
            _left = frames;
            begin();
        });
        isOver.wait();
        return bench::median(_seconds);
    }

 private:
    static protocol::ClusterClientOptions options(int servers, const TypeRegistry& types,
                                                  const std::vector<std::uint16_t>& ports) {
        protocol::ClusterClientOptions options;
        options.identity.name = "bench";
        options.identity.build = "bench";
        options.identity.typeSignature = types.signature();
        options.token = {1, 2};
        options.connectTimeout = std::chrono::seconds(60);
        options.wall = {servers * 16, 16};
        for (int i = 0; i < servers; ++i)
            options.servers.push_back({fmt::format("network-{}", i),
                                       "127.0.0.1",
                                       ports[static_cast<std::size_t>(i)],
                                       {row(servers)[static_cast<std::size_t>(i)]}});
        return options;
    }

    void begin() {
        protocol::OutgoingFrame frame;
        frame.number = ++_frame;
        frame.fromNothing = _frame == 1;
        frame.views = _views;
        _start = bench::secondsNow();
        _running = true;
        _client.beginFrame(std::move(frame), SteadyClock().now());
    }

    void turn() {
        if (const auto& error = _client.error()) {
            std::fprintf(stderr, "bench_barrier: %s\n", error->message.c_str());
            std::_Exit(1);
        }
        if (_client.isBusy()) return;
        if (_running) {
            // Here the swap has left.
            _running = false;
            (void)_client.takeOutcome();
            _seconds.push_back(bench::secondsNow() - _start);
            if (--_left > 0) return begin();
        }
        if (_left > 0 || !_over) return;
        _over->set_value();
        _over.reset();
    }

    Processes _processes;
    wire::Bytes _views;
    protocol::ClusterClient _client;
    net::AsioPump _pump;
    std::thread _thread;
    // On the network thread.
    std::uint64_t _frame = 0;
    int _left = 0;
    bool _running = false;
    double _start = 0.0;
    std::vector<double> _seconds;             // from one frame's beginning to the next one's
    std::optional<std::promise<void>> _over;  // of the run, or of connecting
};

// What an application sees: Cluster::frame, whose threads hand over on both sides.
class ClusterLoop {
 public:
    ClusterLoop(int servers, const TypeRegistry& types, const std::string& program)
        : _scene(types, _ids), _views(viewsOf(servers)) {
        ClusterOptions options;
        options.local = servers;
        options.serverProgram = kPrograms / program;
        options.connectTimeout = std::chrono::seconds(60);
        if (program == "bench_server") options.serverArguments = {"--answer", "draw"};
        _cluster = bench::need(Cluster::connect(options, types, row(servers)));
        _scene.create<Transform>();
        run(3);
    }
    double run(int frames) {
        std::vector<double> seconds;
        for (int i = 0; i < frames; ++i)
            seconds.push_back(
                bench::secondsOf([&] { _last = bench::need(_cluster->frame(_scene, _views, 0.0, false)); }));
        return bench::median(std::move(seconds));
    }
    std::uint64_t bytesOfLastFrame() const { return _last.servers.front().bytes; }

 private:
    IdSource _ids;
    Aspect _scene;
    WallViews _views;
    std::unique_ptr<Cluster> _cluster;
    FrameReport _last;
};

}  // namespace
}  // namespace umbriel

int main(int argc, char** argv) {
    using namespace umbriel;
    const bench::Report report(bench::hasFlag(argc, argv, "--json"));
    const int frames = std::stoi(bench::option(argc, argv, "--frames", "2000"));
    const int rounds = std::stoi(bench::option(argc, argv, "--rounds", "5"));
    const int glUpTo = std::stoi(bench::option(argc, argv, "--gl-up-to", "4"));
    const std::string only = bench::option(argc, argv, "--only", "");
    TypeRegistry types;
    registerCoreTypes(types);
    std::istringstream counts(bench::option(argc, argv, "--servers", "1,2,4,8,16,48"));
    for (std::string text; std::getline(counts, text, ',');) {
        const int servers = std::stoi(text);
        const auto name = [&](const char* what) {
            return fmt::format("barrier, {} server{}: {}", servers, servers == 1 ? "" : "s", what);
        };
        if (!only.empty()) {
            double seconds = 0.0;
            if (only == "plain") seconds = PlainLoop(servers).run(frames);
            if (only == "network") seconds = NetworkLoop(servers, types).run(frames);
            if (only == "draw") seconds = ClusterLoop(servers, types, "bench_server").run(frames);
            report.figure(name(only.c_str()), seconds * 1e6, "us");
            continue;
        }
        PlainLoop plain(servers);
        NetworkLoop network(servers, types);
        ClusterLoop draw(servers, types, "bench_server");
        std::unique_ptr<ClusterLoop> gl;
        if (servers <= glUpTo) gl = std::make_unique<ClusterLoop>(servers, types, "umbriel-server");
        const auto seconds = bench::interleaved(
            rounds, [&] { return plain.run(frames); }, [&] { return network.run(frames); },
            [&] { return draw.run(frames); }, [&] { return gl ? gl->run(frames / 10) : 0.0; });
        report.figure(name("plain loop"), seconds[0] * 1e6, "us");
        report.figure(name("network thread"), seconds[1] * 1e6, "us");
        report.figure(name("hand-over to a draw thread"), seconds[2] * 1e6, "us");
        report.figure(name("network thread / plain"), seconds.ratio({1}, 0), "x", 1.5);
        report.figure(name("hand-over / plain"), seconds.ratio({2}, 0), "x", 3.0);
        if (gl) {
            report.figure(name("OpenGL contexts, 16x16 tiles"), seconds[3] * 1e6, "us");
            report.figure(name("OpenGL contexts / plain"), seconds.ratio({3}, 0), "x");
        }
        report.figure(name("bytes of an idle frame to a server"), static_cast<double>(draw.bytesOfLastFrame()), "bytes",
                      64);
    }
    return 0;
}
