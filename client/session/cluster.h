#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/scene/aspect.h"
#include "common/wall/tile_pixels.h"
#include "common/wall/view.h"

namespace umbriel {

// Where a server listens and, if given, what it must call itself ("left=render1:7420").
struct ServerAddress {
    std::string name;
    std::string host;
    std::uint16_t port = 0;
};

struct ClusterOptions {
    std::vector<ServerAddress> servers;  // none: start `local` embedded servers of this machine on loopback
    int local = 1;
    bool insecureLan = false;            // allow plain TCP beyond loopback
    std::filesystem::path serverProgram; // umbriel-server; empty: beside this program
    Duration connectTimeout = std::chrono::seconds(5);
    Duration frameTimeout = std::chrono::seconds(0);  // 0: wait while heartbeats come
    std::vector<std::string> serverArguments;         // passed on to embedded servers, e.g. --log-level
};

// What one server did for one frame.
struct ServerReport {
    std::string name;
    std::uint64_t bytes = 0;       // sent to it for this frame: all messages and blobs
    std::uint64_t viewBytes = 0;   // of these, views and fits
    double drawMilliseconds = 0.0;
    double waitMilliseconds = 0.0; // from ready until the swap left for it
    std::uint64_t triangles = 0;
    std::uint64_t shadowTriangles = 0;
    std::uint64_t digest = 0;
};

struct FrameReport {
    std::uint64_t frame = 0;
    std::size_t entries = 0;        // of the change list
    std::uint64_t changeBytes = 0;  // encoded, without blobs
    std::vector<ServerReport> servers;
    std::vector<TilePixels> tiles;  // when asked for
};

// A connected wall of render servers, driven from the thread that made it. Frames are lock-step: every server has drawn
// frame n from the same state (compared by digest) before any of them shows it.
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
    // A lost server or a digest that differs is an error naming the server (and container and field).
    virtual Result<FrameReport> frame(Aspect& scene, const WallViews& views, double time, bool wantPixels) = 0;

    // Every server's frame plan as text, after a frame.
    virtual Result<std::vector<std::string>> explain() = 0;

    // Facts that servers stated at the handshake, one line each: name, GL renderer and version, limits.
    virtual std::vector<std::string> serverDescriptions() const = 0;
};

}  // namespace umbriel
