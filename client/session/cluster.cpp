#include "client/session/cluster.h"

#include <fmt/format.h>
#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <thread>
#include <utility>

#include "client/session/incident_log.h"
#include "client/session/server_process.h"
#include "client/session/shadow_fit.h"
#include "client/session/state_difference.h"
#include "common/base/host_port.h"
#include "common/base/log.h"
#include "common/net/asio_pump.h"
#include "common/protocol/cluster_client.h"
#include "common/scene/digest.h"
#include "common/wall/grid.h"
#include "common/wire/change_codec.h"
#include "common/wire/view_codec.h"

namespace umbriel {
namespace {

// Every part of a change list fits into one message, whatever text is in it.
constexpr std::size_t kPartBytes = 128 * 1024;
// Embedded servers start a driver each; on a busy machine dozens of them take a while.
constexpr auto kEmbeddedStart = std::chrono::seconds(60);
constexpr auto kClockPatience = std::chrono::milliseconds(250);
constexpr auto kStillWaiting = std::chrono::seconds(5);
// A server whose state differs says in milliseconds where; it draws nothing meanwhile.
constexpr auto kCompareWithin = std::chrono::seconds(1);

std::filesystem::path programBeside() {
    std::error_code error;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
    return self.parent_path() / "umbriel-server";
}

std::string clientName() {
    char host[256] = {};
    if (::gethostname(host, sizeof(host) - 1) != 0) host[0] = '\0';
    return fmt::format("umbriel-{}@{}", ::getpid(), std::string(host).substr(0, 64));
}

Result<wire::Token> randomToken() {
    wire::Token token;
    if (::getrandom(&token, sizeof(token), 0) != static_cast<ssize_t>(sizeof(token)))
        return failure("the system gives no random numbers");
    return token;
}

// Tiles for every server, round robin, and the wall they make.
struct Dealt {
    PixelSize wall;
    std::vector<std::vector<TileAssignment>> tiles;
};

Dealt deal(const std::vector<TileAssignment>& tiles, std::size_t servers) {
    Dealt dealt{{}, dealTiles(tiles, servers)};
    for (const TileAssignment& tile : tiles) {
        dealt.wall.width = std::max(dealt.wall.width, tile.pixels.x + tile.pixels.width);
        dealt.wall.height = std::max(dealt.wall.height, tile.pixels.y + tile.pixels.height);
    }
    return dealt;
}

class ConnectedCluster final : public Cluster {
 public:
    ConnectedCluster(protocol::ClusterClientOptions options, std::vector<ServerProcess> processes, bool insecureLan)
        : _processes(std::move(processes)),
          _policy(options.policy),
          _addresses(addressesOf(options)),
          _client(std::move(options), SteadyClock().now()),
          _pump(_client, insecureLan) {}

    ~ConnectedCluster() override {
        _pump.enter([this] { _client.leave("the client has finished"); });
        if (_network.joinable()) _pump.wait([this] { return !_client.hasConnections(); }, std::chrono::seconds(2));
        _pump.stop();
        if (_network.joinable()) _network.join();
        for (ServerProcess& process : _processes) process.letGo();
    }

    Result<void> connect(const ClusterOptions& options) {
        if (!options.listenHost.empty()) {
            const auto port = _pump.listen(options.listenHost, options.listenPort);
            if (!port) return port.error();
            // Nothing happens before they are started: that is worth more than an info.
            log::warning("waiting for servers at " + hostPortText(options.listenHost, *port));
        }
        _network = std::thread([this] { _pump.run(); });
        if (auto done = request([] {}, "connecting"); !done) return done;
        announce(nullptr);
        _pump.enter([this] { describe(); });
        return {};
    }

    Result<void> assign(const std::vector<TileAssignment>& tiles) override {
        Dealt dealt = deal(tiles, _names.size());
        if (auto done = drain(); !done) return done;
        return request([&] { _client.assign(dealt.wall, std::move(dealt.tiles)); }, "assigning tiles");
    }

    Result<FrameReport> frame(Aspect& scene, const WallViews& views, double time, bool wantPixels) override {
        protocol::OutgoingFrame outgoing;
        outgoing.views = wire::encodeViews(views);
        std::size_t fits = 0;
        for (const View& view : views.views) fits = std::max(fits, view.fits.size());
        if (fits > wire::kMaxFits || outgoing.views.size() > wire::kMaxViewBytes)
            return badInput(
                fmt::format("{} views with up to {} shadow maps each are more than a frame carries ({} maps a view, {} "
                            "KiB in all): "
                            "take lights away, or their shadows with --shadow none",
                            views.views.size(), fits, wire::kMaxFits, wire::kMaxViewBytes >> 10));
        const bool first = _frameNumber == 0;
        holdShadowColours(scene, views);
        ChangeList changes = scene.commit();
        if (first) changes = scene.snapshot();  // what was committed before it had servers counts as well
        _digest.update(changes, scene);
        wire::EncodedChanges encoded = encode(changes, scene);

        FrameReport& report = _reports.emplace_back();
        report.frame = ++_frameNumber;
        report.entries = encoded.entries;
        report.changeBytes = encoded.bytes();
        outgoing.number = _frameNumber;
        outgoing.wantPixels = wantPixels;
        outgoing.wantCost = _wantCost;
        outgoing.fromNothing = first;
        outgoing.time = time;
        outgoing.changes = std::move(encoded.parts);
        outgoing.blobs = blobsOf(encoded);
        outgoing.digest = _digest.total();
        bool snapshotWanted = false;
        bool digestsWanted = false;
        _pump.enter([&] {
            snapshotWanted = !first && _client.wantsSnapshot();
            digestsWanted = _client.wantsDigests();
        });
        if (digestsWanted) outgoing.digests = std::make_shared<const StateDigest>(_digest);
        if (snapshotWanted) {
            wire::EncodedChanges whole = encode(scene.snapshot(), scene);
            outgoing.snapshot.emplace();
            outgoing.snapshot->parts = std::move(whole.parts);
            outgoing.snapshot->blobs = blobsOf(whole);
        }
        if (auto done = request([&] { _client.beginFrame(std::move(outgoing), SteadyClock().now()); },
                                fmt::format("frame {}", _frameNumber));
            !done)
            return done.error();
        return takeReport(&scene);
    }

    Result<std::optional<FrameReport>> finish() override {
        if (_reports.empty()) return std::optional<FrameReport>();
        if (auto done = request([this] { _client.finishFrames(); }, fmt::format("frame {}", _frameNumber)); !done)
            return done.error();
        auto report = takeReport(nullptr);
        if (!report) return report.error();
        return std::optional<FrameReport>(std::move(*report));
    }

    void measureCost(bool on) override { _wantCost = on; }

    Result<std::vector<std::string>> explain() override {
        std::vector<std::string> texts;
        if (auto done = drain(); !done) return done.error();
        if (auto done = request([&] { _client.beginExplain(); }, "the frame plan"); !done) return done.error();
        _pump.enter([&] { texts = _client.takeExplanations(); });
        return texts;
    }

    protocol::SwapSkew::Summary swapSkew() override {
        _pump.enter([this] { _client.askForClocks(SteadyClock().now()); });
        // Without the last answers it knows less, that is all.
        _pump.wait([this] { return !_client.waitsForClocks(); }, kClockPatience);
        protocol::SwapSkew::Summary summary;
        _pump.enter([&] { summary = _client.swapSkew(); });
        return summary;
    }

    std::vector<std::string> serverDescriptions() const override { return _descriptions; }

    protocol::JobPort& jobs() override { return _jobs; }

 private:
    // What the servers said of themselves.
    void describe() {
        const wire::Hello* first = nullptr;
        for (std::size_t i = 0; i < _client.serverCount(); ++i) {
            const wire::Hello* hello = _client.serverHello(i);
            if (!hello) {
                _names.push_back(_addresses[i]);
                _descriptions.push_back(fmt::format("{}: not connected", _names.back()));
                continue;
            }
            _names.push_back(hello->name);
            _descriptions.push_back(fmt::format("{}: {}, {}, {} (build {})", hello->name, hello->glRenderer,
                                                hello->glVersion, hello->cpu, hello->build));
            if (!first) first = hello;
            if (hello->glRenderer != first->glRenderer || hello->glVersion != first->glVersion ||
                hello->cpu != first->cpu)
                log::warning(
                    fmt::format("servers '{}' and '{}' differ in renderer, version or processor: their tiles may "
                                "differ in last bits",
                                first->name, hello->name));
        }
    }

    class Jobs final : public protocol::JobPort {
     public:
        explicit Jobs(ConnectedCluster& cluster) : _cluster(cluster) {}
        std::size_t serverCount() const override { return _cluster._addresses.size(); }
        std::uint32_t provide(std::vector<wire::Blob> blobs) override {
            std::uint32_t series = 0;
            enter([&](protocol::ClusterClient& client) { series = client.provideBlobs(std::move(blobs)); });
            return series;
        }
        void finish() override {
            enter([](protocol::ClusterClient& client) { client.finishJobs(); });
        }
        void offer(protocol::JobPeer peer, protocol::JobRequest request) override {
            enter([&](protocol::ClusterClient& client) { client.offerJob(peer, request); });
        }
        void cancel(protocol::JobPeer peer, std::uint64_t job, std::uint32_t attempt) override {
            enter([&](protocol::ClusterClient& client) { client.cancelJob(peer, job, attempt); });
        }
        void fetch(protocol::JobPeer peer, const wire::BlobRef& result) override {
            enter([&](protocol::ClusterClient& client) { client.fetchResult(peer, result); });
        }
        Result<std::vector<protocol::JobNews>> wait(Duration most) override {
            std::vector<protocol::JobNews> news;
            std::optional<Error> error;
            _cluster._pump.wait(
                [&] {
                    error = _cluster._client.error();
                    news = _cluster._client.takeJobNews();
                    return error || !news.empty();
                },
                most);
            if (error) return *error;
            return news;
        }

     private:
        template <typename Function>
        void enter(Function function) {
            _cluster._pump.enter([&] { function(_cluster._client); });
        }
        ConnectedCluster& _cluster;
    };

    // Servers take a viewport's colour as they find it; who made the views has said what was replaced.
    static void holdShadowColours(Aspect& scene, const WallViews& views) {
        for (const View& view : views.views) {
            const Viewport* viewport = scene.findAs<Viewport>(view.viewport);
            if (viewport == nullptr) continue;
            const glm::vec3 given = viewport->shadowColor, possible = possibleShadowColour(given);
            if (given != possible) scene.edit(Ref<Viewport>(view.viewport)).set<&Viewport::shadowColor>(possible);
        }
    }

    wire::EncodedChanges encode(const ChangeList& changes, const Aspect& scene) {
        wire::EncodeOptions encoding;
        encoding.maxPartBytes = kPartBytes;
        return wire::encodeChanges(changes, scene, encoding);
    }

    static std::map<Hash128, MultiStorage> blobsOf(wire::EncodedChanges& encoded) {
        std::map<Hash128, MultiStorage> blobs;
        for (wire::Blob& blob : encoded.blobs) blobs.emplace(blob.ref.hash, std::move(blob.data));
        return blobs;
    }

    static std::vector<std::string> addressesOf(const protocol::ClusterClientOptions& options) {
        std::vector<std::string> addresses;
        for (const protocol::RemoteServer& server : options.servers)
            addresses.push_back(!server.name.empty()  ? server.name
                                : server.host.empty() ? fmt::format("server {}", addresses.size() + 1)
                                                      : hostPortText(server.host, server.port));
        return addresses;
    }

    // Waits for a frame that is still drawn; its report comes with the next one.
    Result<void> drain() {
        if (_reports.empty()) return {};
        return request([this] { _client.finishFrames(); }, fmt::format("frame {}", _frameNumber));
    }

    // The oldest frame's report when that frame is over, else an empty one. scene: as it was committed last, when there
    // is one to compare with.
    Result<FrameReport> takeReport(const Aspect* scene) {
        FrameReport report;
        Announced announced = announce(scene);
        report.rejoined = announced.rejoined;
        report.differences = announced.differences;
        if (_finished.empty()) return report;
        protocol::ClusterClient::Finished finished = std::move(_finished.front());
        _finished.pop_front();
        UMBRIEL_ASSERT(!_reports.empty() && _reports.front().frame == finished.number, "frames are over in order");
        _reports.front().rejoined = std::move(announced.rejoined);
        _reports.front().differences = std::move(announced.differences);
        report = std::move(_reports.front());
        _reports.pop_front();
        if (_policy == FailurePolicy::Wait && finished.mismatch) {
            if (auto done = drain(); !done) return done.error();
            if (scene) return differing(*finished.mismatch, *scene);
            return failure(
                fmt::format("frame {}: the state of server '{}' differs", finished.number, _names[*finished.mismatch]));
        }
        report.milliseconds = toMilliseconds(finished.took);
        bool anyConnected = finished.servers.empty();
        for (std::size_t i = 0; i < finished.servers.size(); ++i) {
            protocol::ServerOutcome& outcome = finished.servers[i];
            ServerReport server;
            server.name = _names[i];
            server.bytes = outcome.bytes;
            server.viewBytes = outcome.viewBytes;
            server.drawMilliseconds = outcome.ready.drawMilliseconds;
            server.waitMilliseconds = toMilliseconds(outcome.wait);
            if (outcome.ready.cost) {
                server.cpuMilliseconds = outcome.ready.cost->cpuMilliseconds;
                server.gpuMilliseconds = outcome.ready.cost->gpuMilliseconds;
                server.shadowMapBytes = outcome.ready.cost->shadowMapBytes;
            }
            server.triangles = outcome.ready.triangles;
            server.shadowTriangles = outcome.ready.shadowTriangles;
            server.digest = outcome.ready.digest;
            server.shown = outcome.shown;
            report.servers.push_back(std::move(server));
            anyConnected = anyConnected || outcome.connected;
            if (!outcome.connected)
                report.lost.push_back(_names[i]);
            else if (!outcome.shown)
                report.late.push_back(_names[i]);
            std::move(outcome.tiles.begin(), outcome.tiles.end(), std::back_inserter(report.tiles));
        }
        // Embedded servers are started once: nobody brings them back.
        if (!anyConnected && !_processes.empty())
            return failure(fmt::format("all servers of this program have ended; the last one said: {}", _lastIncident));
        std::sort(report.tiles.begin(), report.tiles.end(),
                  [](const TilePixels& a, const TilePixels& b) { return a.tile.tile < b.tile.tile; });
        return report;
    }

    struct Announced {
        std::vector<std::string> rejoined;
        std::vector<std::string> differences;
    };

    // Takes what the last request left: frames that are over, and what happened to servers, which is logged. Names
    // those that are back. scene: to name what differs in it; may be null.
    Announced announce(const Aspect* scene) {
        using Kind = protocol::ServerIncident::Kind;
        std::vector<protocol::ServerIncident> incidents;
        _pump.enter([&] {
            for (auto& finished : _client.takeFinished()) _finished.push_back(std::move(finished));
            incidents = _client.takeIncidents();
        });
        Announced announced;
        const TimePoint now = SteadyClock().now();
        for (protocol::ServerIncident& incident : incidents) {
            if (incident.kind == Kind::Compared && incident.difference) {
                incident.text = fmt::format("the state of server '{}' differed{}", _names[incident.server],
                                            stateDifferenceText(*incident.difference, scene));
                announced.differences.push_back(incident.text);
            }
            if (incident.kind == Kind::Rejoined) announced.rejoined.push_back(_names[incident.server]);
            _log.add(incident, now);
            if (incident.kind != Kind::Rejoined) _lastIncident = std::move(incident.text);
        }
        for (const IncidentLog::Line& line : _log.take(now))
            line.isWarning ? log::warning(line.text) : log::info(line.text);
        return announced;
    }

    // Starts a request and waits until it is over, saying now and then for whom. It starts on this thread, which saves
    // waking the network thread to tell it what it is to do.
    Result<void> request(const std::function<void()>& start, const std::string& what) {
        _pump.enter([&] {
            if (!_client.error()) start();
        });
        std::optional<Error> error;
        const auto over = [&] {
            error = _client.error();
            return error || !_client.isBusy();
        };
        while (!_pump.wait(over, kStillWaiting)) {
            std::string names;
            _pump.enter([&] {
                for (const std::string& name : _client.waitingFor()) names += (names.empty() ? "" : ", ") + name;
            });
            log::warning(fmt::format("{}: still waiting for {}", what, names));
        }
        if (error) return *error;
        return {};
    }

    // Names the first container and field in which a server's state is not ours.
    Error differing(std::size_t server, const Aspect& scene) {
        protocol::DigestComparison comparison(std::make_shared<const StateDigest>(_digest));
        while (!comparison.difference()) {
            const auto page = digests(server, comparison.query());
            if (!page) return page.error();
            comparison.answered(*page);
        }
        return failure(fmt::format("frame {}: the state of server '{}' differs{}", _frameNumber, _names[server],
                                   stateDifferenceText(*comparison.difference(), &scene)));
    }

    Result<wire::DigestReply> digests(std::size_t server, wire::DigestQuery query) {
        wire::DigestReply reply;
        if (auto done = request([&] { _client.beginDigestQuery(server, query); }, "comparing states"); !done)
            return done.error();
        _pump.enter([&] { reply = _client.takeDigests(); });
        return reply;
    }

    std::vector<ServerProcess> _processes;  // destroyed last: they end when their session has
    FailurePolicy _policy;
    std::vector<std::string> _addresses;  // what servers are called before they said their names
    protocol::ClusterClient _client;      // asked inside the pump only
    net::AsioPump _pump;
    std::thread _network;

    std::deque<protocol::ClusterClient::Finished> _finished;
    bool _wantCost = false;
    IncidentLog _log;
    std::string _lastIncident;
    std::uint64_t _frameNumber = 0;
    std::deque<FrameReport> _reports;  // of frames under way
    StateDigest _digest;
    std::vector<std::string> _names;
    std::vector<std::string> _descriptions;
    Jobs _jobs{*this};
};

}  // namespace

Result<std::unique_ptr<Cluster>> Cluster::connect(const ClusterOptions& options, const TypeRegistry& types,
                                                  std::vector<TileAssignment> tiles) {
    protocol::ClusterClientOptions client;
    const auto token = randomToken();
    if (!token) return token.error();
    client.token = *token;
    client.identity.name = clientName();
    client.identity.build = UMBRIEL_VERSION;
    client.identity.typeSignature = types.signature();
    client.identity.needs = wire::kReturnsPixels;
    client.connectTimeout = options.connectTimeout;
    client.frameTimeout = options.frameTimeout;
    client.policy = options.policy;
    client.latency = options.latency;
    client.compareWithin = kCompareWithin;
    client.startIncomplete = options.startIncomplete && options.policy != FailurePolicy::Wait;

    std::vector<ServerProcess> processes;
    if (options.servers.empty()) {
        const auto program = options.serverProgram.empty() ? programBeside() : options.serverProgram;
        const int count = std::max(1, options.local);
        // llvmpipe's own threads only get in each other's way when every core has a server.
        std::vector<std::string> environment;
        if (count >= static_cast<int>(std::thread::hardware_concurrency())) environment.push_back("LP_NUM_THREADS=0");
        for (int i = 0; i < count; ++i) {
            client.servers.push_back({fmt::format("local-{}", i + 1), "127.0.0.1", 0, {}});
            std::vector<std::string> arguments = {"--name", client.servers.back().name, "--listen", "127.0.0.1:0"};
            arguments.insert(arguments.end(), options.serverArguments.begin(), options.serverArguments.end());
            auto process = ServerProcess::start(program, std::move(arguments), environment);
            if (!process) return process.error();
            processes.push_back(std::move(*process));
        }
        const TimePoint end = SteadyClock().now() + kEmbeddedStart;
        for (int i = 0; i < count; ++i) {
            const auto port = processes[static_cast<std::size_t>(i)].waitForPort(end - SteadyClock().now());
            if (!port) return port.error();
            client.servers[static_cast<std::size_t>(i)].port = *port;
        }
    } else {
        for (const ServerAddress& server : options.servers)
            client.servers.push_back({server.name, server.host, server.port, {}});
    }
    Dealt dealt = deal(tiles, client.servers.size());
    client.wall = dealt.wall;
    for (std::size_t i = 0; i < client.servers.size(); ++i) client.servers[i].tiles = std::move(dealt.tiles[i]);
    auto cluster = std::make_unique<ConnectedCluster>(std::move(client), std::move(processes), options.insecureLan);
    if (const auto connected = cluster->connect(options); !connected) return connected.error();
    return std::unique_ptr<Cluster>(std::move(cluster));
}

}  // namespace umbriel
