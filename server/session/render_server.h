#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "common/base/result.h"
#include "common/scene/type_descriptor.h"
#include "server/bake/job_queue.h"
#include "server/draw/renderer.h"

namespace umbriel {

// Who a render server is, how it is reached, and what it may keep and do beside drawing.
struct RenderServerOptions {
    std::string name;
    std::string build;                     // of the program
    std::string listenHost = "127.0.0.1";  // ignored when dialHost is given
    std::uint16_t listenPort = 0;          // 0: one that is free
    std::string dialHost;                  // not empty: reach the client there
    std::uint16_t dialPort = 0;
    bool insecureLan = false;
    bool once = false;                     // ends when its first client has left
    std::string glRenderer;                // stated at the handshake
    std::string glVersion;
    std::string cpu;
    std::uint64_t blobBudgetBytes = std::uint64_t{2} << 30;  // kept in memory
    std::filesystem::path blobCache;                         // a folder to keep blobs in, too; empty: none
    std::uint64_t blobCacheBytes = std::uint64_t{8} << 30;   // of it
    std::map<std::string, JobHandler> jobs;  // what it can do beside drawing, by kind
    int jobThreads = 1;
    JobPriority jobPriority = JobPriority::Idle;
    std::function<void(std::uint16_t port)> listening;  // called by run() once it can be reached
};

// A render server between the network and its renderer: one client at a time, frames drawn on the thread that calls
// run(), everything else on a network thread of its own.
class RenderServer {
 public:
    // types and renderer must outlive it.
    RenderServer(RenderServerOptions options, const TypeRegistry& types, Renderer& renderer);
    ~RenderServer();
    RenderServer(const RenderServer&) = delete;
    RenderServer& operator=(const RenderServer&) = delete;

    // Serves clients until stop(), or until the first one has left. An error when it cannot listen.
    Result<void> run();
    // From any thread, also before run(); not from a signal handler.
    void stop();

 private:
    struct Implementation;
    std::unique_ptr<Implementation> _implementation;
};

}  // namespace umbriel
