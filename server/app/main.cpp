#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <optional>
#include <string>
#include <thread>

#include "common/base/host_port.h"
#include "common/base/log.h"
#include "common/scene/core_types.h"
#include "server/bake/visibility_jobs.h"
#include "server/draw/renderer.h"
#include "server/gl/context.h"
#include "server/session/render_server.h"

namespace {

using namespace umbriel;

constexpr int kExitFailure = 1;
constexpr int kExitBadInput = 2;

constexpr const char* kExamples = R"(
Examples:
  umbriel-server --name left
      serves clients of this machine on 127.0.0.1:7420
  umbriel-server --name left --listen 0.0.0.0:7420 --insecure-lan
      serves clients of the network; do this on a network you trust only
  umbriel-server --name left --connect desk:7421 --insecure-lan
      dials a client that waits for it

Exit codes: 0 ended as asked, 1 it could not be done, 2 the arguments are wrong.
)";

int report(const Error& error) {
    log::error(error.message);
    return error.kind == Error::Kind::BadInput ? kExitBadInput : kExitFailure;
}

Result<HostPort> parseAddress(const std::string& option, const std::string& text, bool mayBeZero) {
    const auto address = parseHostPort(text, mayBeZero);
    if (address) return *address;
    return badInput(
        fmt::format("{} '{}': expected HOST:PORT, for example 127.0.0.1:7420 or [::1]:7420", option, text));
}

// The processor's class decides about last bits in software rendering.
std::string cpuModel() {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (line.rfind("model name", 0) == 0)
            if (const auto colon = line.find(": "); colon != std::string::npos) return line.substr(colon + 2);
    return "unknown processor";
}

std::string hostName() {
    char name[256] = {};
    return ::gethostname(name, sizeof(name) - 1) == 0 && name[0] ? name : "server";
}

// Ends this process when the client that started it is gone, however that happened and whatever this process is doing.
void dieWithParent(int descriptor) {
    std::thread([descriptor] {
        char byte = 0;
        while (::read(descriptor, &byte, 1) > 0 || errno == EINTR) errno = 0;
        ::kill(::getpid(), SIGTERM);
        // The orderly way out takes a moment at most; a driver that hangs must not keep us.
        std::this_thread::sleep_for(std::chrono::milliseconds(1500));
        ::_exit(0);
    }).detach();
}

}  // namespace

int main(int argc, char** argv) {
    std::string name = hostName();
    std::string listenText = "127.0.0.1:7420";
    std::string connectText;
    std::string logLevel = "info";
    bool headless = false;
    bool window = false;
    bool insecureLan = false;
    bool embedded = false;
    bool doctor = false;
    std::optional<int> gpu;
    int bakeThreads = 0;
    std::string bakePriority = "idle";
    std::string blobCache;
    std::uint64_t blobCacheBytes = RenderServerOptions().blobCacheBytes;
    int reportDescriptor = -1;

    CLI::App app("Umbriel render server: draws its tiles of a wall for one client at a time.");
    app.footer(kExamples);
    app.set_version_flag("--version", std::string("umbriel-server ") + UMBRIEL_VERSION);
    app.add_option("--name", name, "what clients call this server (default: the machine's name)");
    auto* listen = app.add_option("--listen", listenText, "HOST:PORT to wait for clients at")->capture_default_str();
    auto* connect = app.add_option("--connect", connectText, "HOST:PORT of a client that waits for this server");
    connect->excludes(listen);
    auto* headlessFlag = app.add_flag("--headless", headless, "draw without a display (the default)");
    app.add_flag("--window", window, "draw into a window")->excludes(headlessFlag);
    app.add_option("--gpu", gpu, "index of the EGL device to draw with (umbriel doctor lists them)");
    auto* cache = app.add_option("--blob-cache", blobCache,
                                 "folder to keep large contents in, so that they need not be sent again");
    app.add_option("--blob-cache-bytes", blobCacheBytes, "how large that folder may become")
        ->capture_default_str()
        ->needs(cache)
        ->check(CLI::Range(std::uint64_t{1} << 20, std::uint64_t{1} << 50));
    app.add_flag("--insecure-lan", insecureLan, "allow connections beyond this machine, unprotected");
    app.add_option("--bake-threads", bakeThreads, "threads that bake beside drawing (default: one per processor)");
    app.add_option("--bake-priority", bakePriority,
                   "idle: bake with what drawing leaves; normal: for servers that only bake")
        ->capture_default_str();
    app.add_option("--log-level", logLevel, "trace, debug, info, warning, error or off")->capture_default_str();
    app.add_flag("--doctor", doctor, "say what OpenGL offers on this machine, and end");
    app.add_flag("--embedded", embedded, "end when the first client has left")->group("");
    app.add_option("--report-port-fd", reportDescriptor, "write the port to this descriptor, end when it is closed")->group("");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        const int code = app.exit(error, std::cout, std::cerr);
        return code == 0 ? 0 : kExitBadInput;
    }
    if (!log::setLevel(logLevel))
        return report(badInput(fmt::format("--log-level '{}': it is one of trace, debug, info, warning, error, off", logLevel)));
    if (window)
        return report(badInput("--window: this version draws headless only; `umbriel view` shows a wall in a window"));
    if (name.empty() || name.size() > 64 || name.find_first_of("=:@,\n\t ") != std::string::npos)
        return report(badInput(fmt::format("--name '{}': 1 to 64 characters without spaces and without = : @ ,", name)));

    if (bakeThreads < 0 || bakeThreads > 1024)
        return report(badInput(fmt::format("--bake-threads {}: expected 1 to 1024, or 0 for one per processor", bakeThreads)));
    if (bakePriority != "idle" && bakePriority != "normal")
        return report(badInput(fmt::format("--bake-priority '{}': expected idle or normal", bakePriority)));

    RenderServerOptions options;
    options.jobThreads = bakeThreads > 0 ? bakeThreads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    options.jobPriority = bakePriority == "idle" ? JobPriority::Idle : JobPriority::Normal;
    gl::ContextOptions contextOptions;
    contextOptions.deviceIndex = gpu;
    options.jobs = visibilityJobs(options.jobThreads, contextOptions);
    options.name = name;
    options.build = UMBRIEL_VERSION;
    options.insecureLan = insecureLan;
    options.blobCache = blobCache;
    options.blobCacheBytes = blobCacheBytes;
    // With a descriptor it ends when its client lets go of that: a session that was lost may be followed by another.
    options.once = embedded && reportDescriptor < 0;
    if (!connectText.empty()) {
        const auto address = parseAddress("--connect", connectText, false);
        if (!address) return report(address.error());
        options.dialHost = address->host;
        options.dialPort = address->port;
    } else {
        const auto address = parseAddress("--listen", listenText, true);
        if (!address) return report(address.error());
        options.listenHost = address->host;
        options.listenPort = address->port;
    }
    log::setPrefix(name);
    if (embedded && logLevel == "info") log::setLevel(log::Level::Warning);  // its client says what happens

    // Blocked here and in every thread to come; one thread waits for them.
    sigset_t signals;
    ::sigemptyset(&signals);
    ::sigaddset(&signals, SIGINT);
    ::sigaddset(&signals, SIGTERM);
    ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    ::signal(SIGPIPE, SIG_IGN);

    if (reportDescriptor >= 0) {
        struct stat status;
        if (::fstat(reportDescriptor, &status) != 0)
            return report(badInput(fmt::format("--report-port-fd {}: there is no such descriptor", reportDescriptor)));
        ::fcntl(reportDescriptor, F_SETFD, FD_CLOEXEC);
        dieWithParent(reportDescriptor);
    }
    options.listening = [reportDescriptor, host = options.listenHost](std::uint16_t port) {
        log::info(fmt::format("listening on {}", hostPortText(host, port)));
        if (reportDescriptor < 0) return;
        const std::string text = fmt::format("{}\n", port);
        if (::write(reportDescriptor, text.data(), text.size()) < 0) log::warning("the port could not be reported");
    };

    auto context = gl::HeadlessContext::create(contextOptions);
    if (!context) return report(context.error());
    if (doctor) {
        for (const std::string& line : gl::report(context->info())) std::puts(line.c_str());
        const std::vector<std::string> devices = gl::listDevices();
        for (std::size_t i = 0; i < devices.size(); ++i) fmt::print("--gpu {}: {}\n", i, devices[i]);
        return 0;
    }
    options.glRenderer = context->info().renderer;
    options.glVersion = context->info().version;
    options.cpu = cpuModel();
    auto renderer = Renderer::create(*context, {});
    if (!renderer) return report(renderer.error());

    TypeRegistry types;
    registerCoreTypes(types);
    RenderServer server(std::move(options), types, **renderer);
    std::thread([&server, signals] {
        int signal = 0;
        ::sigwait(&signals, &signal);
        server.stop();
        // A second one ends a server that cannot end itself.
        ::sigwait(&signals, &signal);
        ::_exit(kExitFailure);
    }).detach();
    if (const auto done = server.run(); !done) return report(done.error());
    return 0;
}
