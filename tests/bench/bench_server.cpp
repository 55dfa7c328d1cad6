// A render server's process without drawing, for the benchmarks. --answer says what it is:
//   plain    a loop over a blocking socket: reads a frame, writes a ready, reads a swap
//   receive  takes bytes without looking at them: 8 bytes of length, the bytes; answers each with one byte
//   keep     as receive, and keeps them in fresh memory until it has answered
//   network  the protocol, answered on the network thread
//   draw     the whole server with a renderer that draws nothing (--draw-ms N: that takes so long; --port N,
//   --blob-cache
//            DIR: as umbriel-server has them)

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>

#include "common/base/clock.h"
#include "common/net/asio_pump.h"
#include "common/protocol/server_node.h"
#include "common/scene/core_types.h"
#include "common/scene/digest.h"
#include "common/wire/change_codec.h"
#include "server/session/render_server.h"
#include "tests/bench/measure.h"
#include "tests/bench/plain_messages.h"
#include "tests/bench/plain_socket.h"
#include "tests/support/fake_renderer.h"

namespace umbriel {
namespace {

void reportPort(int descriptor, std::uint16_t port) {
    const std::string text = fmt::format("{}\n", port);
    if (::write(descriptor, text.data(), text.size()) < 0) std::exit(1);
    // Whoever started us holds the other end.
    std::thread([descriptor] {
        char byte = 0;
        while (::read(descriptor, &byte, 1) > 0) {
        }
        ::_exit(0);
    }).detach();
}

void servePlain(bench::PlainSocket socket) {
    wire::Bytes frame = bench::plainFrame();
    wire::Bytes swap = bench::plainSwap();
    const wire::Bytes ready = bench::plainReady();
    while (socket.read(frame)) {
        socket.write(ready);
        if (!socket.read(swap)) return;
    }
}

// keeping: in memory that nobody has touched before, as a server that joins must.
void serveReceive(bench::PlainSocket socket, bool keeping) {
    constexpr std::size_t kHugePage = std::size_t{2} << 20;
    std::uint64_t size = 0;
    wire::Bytes buffer(256 * 1024);
    while (socket.read(std::as_writable_bytes(std::span(&size, 1)))) {
        const std::size_t kept = keeping ? (size + kHugePage - 1) / kHugePage * kHugePage : 0;
        void* memory = keeping ? std::aligned_alloc(kHugePage, kept) : nullptr;
        if (memory) ::madvise(memory, kept, MADV_HUGEPAGE);
        auto* to = static_cast<std::byte*>(memory);
        while (size > 0) {
            const std::size_t count = std::min<std::uint64_t>(size, buffer.size());
            if (!socket.read(std::span(buffer).first(count))) return;
            size -= count;
            if (to) to = std::copy_n(buffer.data(), count, to);
        }
        socket.write(std::span(buffer).first(1));
        std::free(memory);
    }
}

// Changes are applied and digested as in a render server, but on the network thread.
class NetworkServer {
 public:
    NetworkServer(const std::string& name, const TypeRegistry& types)
        : _node(options(name, types), SteadyClock().now()), _pump(_node, false), _scene(types, _ids), _decoder(_scene) {
        _pump.onTurn([this] { turn(); });
    }

    void run(int descriptor) {
        reportPort(descriptor, bench::need(_pump.listen("127.0.0.1", 0)));
        _pump.run();
    }

 private:
    static protocol::ServerNodeOptions options(const std::string& name, const TypeRegistry& types) {
        protocol::ServerNodeOptions options;
        options.identity.name = name;
        options.identity.build = "bench";
        options.identity.typeSignature = types.signature();
        return options;
    }

    void turn() {
        while (auto next = _node.nextEvent()) {
            const auto* frame = std::get_if<protocol::server_event::FrameRequested>(&*next);
            if (!frame) continue;
            for (const wire::Bytes& part : frame->changes)
                if (const auto done = _decoder.apply(part, _blobs); !done)
                    return _node.endSession(done.error().message);
            if (!frame->changes.empty()) _digest.update(_scene.commit(), _scene);
            wire::Ready ready;
            ready.digest = _digest.total();
            _node.sendReady(frame->number, ready);
        }
    }

    protocol::ServerNode _node;
    net::AsioPump _pump;
    IdSource _ids;
    Aspect _scene;
    wire::ChangeDecoder _decoder;
    wire::BlobStore _blobs;
    StateDigest _digest;
};

struct DrawOptions {
    int milliseconds = 0;    // drawing takes so long
    std::uint16_t port = 0;  // 0: one that is free
    std::string blobCache;
};

int serveDraw(const std::string& name, const TypeRegistry& types, int descriptor, const DrawOptions& draw) {
    test::FakeRenderer renderer;
    if (draw.milliseconds > 0)
        renderer.whileDrawing = [&draw] { std::this_thread::sleep_for(std::chrono::milliseconds(draw.milliseconds)); };
    RenderServerOptions options;
    options.name = name;
    options.build = "bench";
    options.once = true;
    options.listenPort = draw.port;
    options.blobCache = draw.blobCache;
    options.listening = [descriptor](std::uint16_t port) { reportPort(descriptor, port); };
    RenderServer server(std::move(options), types, renderer);
    const auto done = server.run();
    if (!done) std::fprintf(stderr, "bench_server: %s\n", done.error().message.c_str());
    return done ? 0 : 1;
}

}  // namespace
}  // namespace umbriel

int main(int argc, char** argv) {
    using namespace umbriel;
    const std::string answer = bench::option(argc, argv, "--answer", "draw");
    const std::string name = bench::option(argc, argv, "--name", "bench");
    const int descriptor = std::stoi(bench::option(argc, argv, "--report-port-fd", "1"));
    const auto report = [descriptor](std::uint16_t port) { reportPort(descriptor, port); };
    TypeRegistry types;
    registerCoreTypes(types);
    if (answer == "plain")
        servePlain(bench::PlainSocket::accept(report));
    else if (answer == "receive")
        serveReceive(bench::PlainSocket::accept(report), false);
    else if (answer == "keep")
        serveReceive(bench::PlainSocket::accept(report), true);
    else if (answer == "network")
        NetworkServer(name, types).run(descriptor);
    else
        return serveDraw(name, types, descriptor,
                         {std::stoi(bench::option(argc, argv, "--draw-ms", "0")),
                          static_cast<std::uint16_t>(std::stoi(bench::option(argc, argv, "--port", "0"))),
                          bench::option(argc, argv, "--blob-cache", "")});
    return 0;
}
