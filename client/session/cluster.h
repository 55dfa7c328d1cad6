#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/protocol/failure_policy.h"
#include "common/protocol/job_port.h"
#include "common/protocol/swap_skew.h"
#include "common/scene/aspect.h"
#include "common/wall/tile_pixels.h"
#include "common/wall/view.h"

namespace umbriel {

using protocol::FailurePolicy;

// Where a server listens and, if given, what it must call itself ("left=render1:7420").
struct ServerAddress {
    std::string name;
    std::string host;  // empty: it dials this client, at ClusterOptions::listenHost
    std::uint16_t port = 0;
};

// Which servers a wall has, how they are reached, and what happens when one is late or lost.
struct ClusterOptions {
    std::vector<ServerAddress> servers;  // none: start `local` embedded servers of this machine on loopback
    int local = 1;
    std::string listenHost;               // not empty: servers without a host dial this client here
    std::uint16_t listenPort = 0;         // 0: one that is free, which is logged
    bool insecureLan = false;             // allow plain TCP beyond loopback
    std::filesystem::path serverProgram;  // umbriel-server; empty: beside this program
    Duration connectTimeout = std::chrono::seconds(5);
    Duration frameTimeout = std::chrono::seconds(0);  // 0: none; else a frame that takes longer is an error
    FailurePolicy policy = FailurePolicy::Wait;       // what a late or lost server does to a frame
    int latency = 0;               // 1: frame() returns when the frame before is over, while this one is drawn
    bool startIncomplete = false;  // not under Wait: servers that cannot be reached at the start join later
    std::vector<std::string> serverArguments;  // passed on to embedded servers, e.g. --log-level
};

// What one server did for one frame.
struct ServerReport {
    std::string name;
    std::uint64_t bytes = 0;      // sent to it for this frame: all messages and blobs
    std::uint64_t viewBytes = 0;  // of these, views and fits
    double drawMilliseconds = 0.0;
    double waitMilliseconds = 0.0;  // from ready until the swap left for it
    // When asked for by measureCost(): all of its threads while it drew, a software renderer's with them; by a timer
    // query, 0 where there is no honest one; bytes it holds for shadow maps.
    double cpuMilliseconds = 0.0;
    double gpuMilliseconds = 0.0;
    std::uint64_t shadowMapBytes = 0;
    std::uint64_t triangles = 0;
    std::uint64_t shadowTriangles = 0;
    std::uint64_t digest = 0;
    bool shown = true;  // false: it was late or lost, its tiles hold their last picture
};

// What a frame was and cost, and which servers did not take part in it.
struct FrameReport {
    std::uint64_t frame = 0;
    double milliseconds = 0.0;      // from its request to its swap, pixels included when they were asked for
    std::size_t entries = 0;        // of the change list
    std::uint64_t changeBytes = 0;  // encoded, without blobs
    std::vector<ServerReport> servers;
    std::vector<TilePixels> tiles;      // when asked for; of servers that were late or lost they are missing
    std::vector<std::string> late;      // servers that did not show this frame
    std::vector<std::string> lost;      // servers that are not connected
    std::vector<std::string>
        differences;                    // what was found in servers whose state was not the client's: container, field
    std::vector<std::string> rejoined;  // servers that show again what the others show, since the last report
};

// A connected wall of render servers, driven from the thread that made it. Frames are in step: every server has drawn
// frame n from the same state (compared by digest) before any of them shows it. Servers that are late or lost hold the
// others up as long as the policy says; they get what they missed, or a snapshot, while the others go on.
class Cluster {
 public:
    // Starts or reaches the servers, shakes hands, assigns tiles (round robin when there are fewer servers than tiles).
    // An unreachable, misnamed or mismatching server is an error within connectTimeout.
    static Result<std::unique_ptr<Cluster>> connect(const ClusterOptions& options, const TypeRegistry& types,
                                                    std::vector<TileAssignment> tiles);
    virtual ~Cluster() = default;  // says goodbye; embedded servers end

    // Between frames: another wall, or another cut; tiles go round robin as in connect().
    virtual Result<void> assign(const std::vector<TileAssignment>& tiles) = 0;

    // Commits the aspect, ships what changed, draws, swaps. The views travel when they differ from the last frame's.
    // Under Wait a lost server or a digest that differs is an error naming the server (and container and field); under
    // the other policies it is a warning in the log, and the report names the server. With latency 1 the report is the
    // one of the frame before (number 0 when there was none), and tiles come with it.
    virtual Result<FrameReport> frame(Aspect& scene, const WallViews& views, double time, bool wantPixels) = 0;

    // With latency 1: waits for the frame that is still drawn. Nothing when there is none.
    virtual Result<std::optional<FrameReport>> finish() = 0;

    // Whether the reports of the frames from now on say what they cost the servers; 2 to 14 bytes more for each answer.
    virtual void measureCost(bool on) = 0;

    // Every server's frame plan as text, after a frame; empty for a server that is late or lost.
    virtual Result<std::vector<std::string>> explain() = 0;

    // Jobs on the same servers, beside frames: to be used from one thread, which need not be the one that draws.
    virtual protocol::JobPort& jobs() = 0;

    // How far apart the servers have shown the frames they were told to show together.
    virtual protocol::SwapSkew::Summary swapSkew() = 0;

    // Facts that servers stated at the handshake, one line each: name, GL renderer and version, limits.
    virtual std::vector<std::string> serverDescriptions() const = 0;
};

}  // namespace umbriel
