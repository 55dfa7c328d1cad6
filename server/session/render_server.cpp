#include "server/session/render_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <future>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/net/asio_pump.h"
#include "common/protocol/server_node.h"
#include "common/wire/change_codec.h"
#include "server/bake/job_queue.h"
#include "server/session/blob_cache.h"
#include "server/session/blob_librarian.h"
#include "server/session/draw_thread.h"

namespace umbriel {

namespace event = protocol::server_event;

namespace {

// A client that does not run for a while, on a machine that is busy, has lost nothing: what was said to it lies in its
// sockets. Whether its machine is still there is TCP's to find out.
constexpr auto kStoppedClient = std::chrono::seconds(10);

protocol::ServerNodeOptions nodeOptions(const RenderServerOptions& options, const TypeRegistry& types) {
    protocol::ServerNodeOptions node;
    node.link.heartbeatLoss = kStoppedClient;
    node.identity.name = options.name;
    node.identity.build = options.build;
    node.identity.typeSignature = types.signature();
    node.identity.glRenderer = options.glRenderer.substr(0, wire::Hello::kMaxText);
    node.identity.glVersion = options.glVersion.substr(0, wire::Hello::kMaxText);
    node.identity.cpu = options.cpu.substr(0, wire::Hello::kMaxText);
    node.identity.capabilities = wire::kReturnsPixels | wire::kReportsSwaps;
    if (!options.jobs.empty()) node.identity.capabilities |= wire::kWorksOnJobs;
    node.identity.maxBlobBytes = std::min(wire::kMaxBlobBytes, options.blobBudgetBytes);
    node.dialHost = options.dialHost;
    node.dialPort = options.dialPort;
    return node;
}

}  // namespace

// Everything here is touched inside the pump only, by the network thread or by the drawing one; the queue apart.
struct RenderServer::Implementation {
    RenderServerOptions options;
    const TypeRegistry& types;
    Renderer& renderer;
    DrawQueue queue;
    protocol::ServerNode node;
    net::AsioPump pump;

    // The receiving aspect: a frame's changes are decoded into it while the previous frame may still be drawn from the
    // other one.
    IdSource ids;
    Aspect incoming;
    std::optional<wire::ChangeDecoder> decoder;
    bool incomingBusy = false;   // its last list is not applied to the drawn aspect yet
    BlobCache blobs;
    std::deque<event::FrameRequested> frames;
    bool blobsAsked = false;     // for the first of them
    struct Decoding {            // of the first of them
        draw_task::Draw draw;
        std::size_t parts = 0;  // that are applied
    };
    std::optional<Decoding> decoding;
    std::uint64_t session = 0;   // counts them, so that answers for an old one are dropped
    bool inSession = false;
    bool firstFrame = false;
    struct WaitingJob {
        JobOffer offer;
        std::vector<wire::BlobRef> needed;  // offer.blobs has the first of them
    };
    std::deque<WaitingJob> waitingJobs;  // for blobs
    std::unique_ptr<JobQueue> jobs;      // posts to the pump until it is gone
    std::unique_ptr<BlobLibrarian> librarian;  // likewise; null without a folder
    std::optional<Error> error;      // why it makes no sense to go on
    bool leaving = false;
    std::promise<void> left;     // when the last connection is closed

    Implementation(RenderServerOptions o, const TypeRegistry& t, Renderer& r)
        : options(std::move(o)), types(t), renderer(r), node(nodeOptions(options, t), SteadyClock().now()),
          pump(node, options.insecureLan), incoming(t, ids), blobs(options.blobBudgetBytes) {
        decoder.emplace(incoming);
        jobs = std::make_unique<JobQueue>(
            options.jobs, [this] { pump.post([] {}); }, options.jobThreads, options.jobPriority);
        pump.onTurn([this] { turn(); });
    }

    void push(DrawTask task) {
        if (!queue.push({session, std::move(task)})) node.endSession("the client asks for more than is drawn");
    }

    void turn() {
        while (auto next = node.nextEvent())
            std::visit([&](auto& what) { handle(what); }, *next);
        decodeNext();
        reportJobs();
        if (leaving && !node.hasConnections()) {
            leaving = false;
            left.set_value();
        }
    }

    void handle(event::SessionStarted& started) {
        log::info(fmt::format("client '{}' is connected", started.client));
        ++session;
        inSession = true;
        firstFrame = true;
    }
    void handle(event::SessionEnded& ended) {
        log::info(fmt::format("the session has ended: {}", ended.reason));
        inSession = false;
        frames.clear();
        blobsAsked = false;
        decoding.reset();
        waitingJobs.clear();
        jobs->cancelAll();
        jobs->takeEvents();  // nobody is there to hear of them
        if (options.once && !node.hasSession()) queue.push({session, draw_task::Stop{}});
    }
    void handle(event::ClientUnreachable& unreachable) {
        if (unreachable.reason.kind != Error::Kind::BadInput) return log::warning(unreachable.reason.message);
        error = std::move(unreachable.reason);
        queue.push({session, draw_task::Stop{}});
    }
    void handle(event::Assigned& assigned) { push(draw_task::Assign{std::move(assigned.tiles)}); }
    void handle(event::FrameRequested& frame) { frames.push_back(std::move(frame)); }
    void handle(event::SwapRequested& swap) { push(draw_task::Swap{swap.frame}); }
    void handle(event::BlobArrived& arrived) {
        if (librarian) librarian->store(arrived.blob);
        blobs.put(std::move(arrived.blob));
        startJobs();
        if (frames.empty()) blobs.trim();
    }
    void handle(event::DigestAsked& asked) { push(draw_task::Digests{asked.query}); }
    void handle(event::ExplainAsked&) { push(draw_task::Explain{}); }
    void handle(event::JobOffered& offer) {
        const JobKey key{offer.job, offer.attempt, session};
        if (waitingJobs.size() >= JobQueue::kLimit)
            return node.sendJobDone({offer.job, offer.attempt, wire::JobStatus::Refused,
                                     "this server has enough to do", {}, 0, 0}, {});
        waitingJobs.push_back({{key, std::move(offer.kind), std::move(offer.payload), offer.lease, {}},
                               std::move(offer.blobs)});
        startJobs();
    }
    void handle(event::JobCancelled& cancelled) {
        const JobKey key{cancelled.job, cancelled.attempt, session};
        const auto waits = [&](const WaitingJob& waiting) { return waiting.offer.key == key; };
        if (std::erase_if(waitingJobs, waits) == 0) return jobs->cancel(key);
        node.sendJobDone({key.job, key.attempt, wire::JobStatus::Cancelled, {}, {}, 0, 0}, {});
    }

    // Jobs whose contents are all here begin, in the order of their offers; for the others the rest is asked for.
    void startJobs() {
        for (auto waiting = waitingJobs.begin(); waiting != waitingJobs.end();) {
            std::vector<wire::Blob>& have = waiting->offer.blobs;
            const std::vector<wire::BlobRef>& needed = waiting->needed;
            // Held as soon as they are here: the cache may drop them.
            while (have.size() < needed.size()) {
                const MultiStorage* content = blobs.find(needed[have.size()].hash);
                if (!content) break;
                blobs.touch(needed[have.size()].hash);
                have.push_back({needed[have.size()], *content});
            }
            if (have.size() < needed.size()) {
                std::vector<wire::BlobRef> missing(needed.begin() + static_cast<std::ptrdiff_t>(have.size()), needed.end());
                std::erase_if(missing, [&](const wire::BlobRef& ref) { return blobs.find(ref.hash) != nullptr; });
                node.wantBlobs(missing);
                ++waiting;
                continue;
            }
            jobs->offer(std::move(waiting->offer));
            waiting = waitingJobs.erase(waiting);
        }
    }

    void reportJobs() {
        for (JobEvent& done : jobs->takeEvents()) {
            const auto [job, attempt, of] = done.key;
            if (of != session) continue;
            const auto end = [&, job = job, attempt = attempt](wire::JobStatus status) {
                const auto processor = static_cast<std::uint64_t>(done.processor / std::chrono::microseconds(1));
                node.sendJobDone({job, attempt, status, std::move(done.text), {}, 0, processor}, std::move(done.result));
            };
            switch (done.kind) {
                case JobEvent::Kind::Lease: node.sendJobLease({job, attempt, done.progress}); break;
                case JobEvent::Kind::Done: end(wire::JobStatus::Done); break;
                case JobEvent::Kind::Failed: end(wire::JobStatus::Failed); break;
                case JobEvent::Kind::Cancelled: end(wire::JobStatus::Cancelled); break;
                case JobEvent::Kind::Refused: end(wire::JobStatus::Refused); break;
            }
        }
    }

    // True when all blobs of the frame are here; asks for the others once.
    Result<bool> haveBlobs(const event::FrameRequested& frame) {
        std::vector<wire::BlobRef> missing;
        std::set<Hash128> seen;
        for (const wire::Bytes& part : frame.changes) {
            auto refs = wire::blobsReferenced(part);
            if (!refs) return refs.error();
            for (const wire::BlobRef& ref : *refs) {
                if (!seen.insert(ref.hash).second) continue;
                if (blobs.find(ref.hash)) blobs.touch(ref.hash);
                else missing.push_back(ref);
            }
        }
        if (missing.empty()) return true;
        if (std::exchange(blobsAsked, true)) return false;
        if (librarian)
            librarian->load(session, std::move(missing));
        else
            node.wantBlobs(missing);
        return false;
    }

    // What the folder has of the blobs of a frame; the client is asked for the others.
    void found(BlobLibrarian::Loaded& loaded) {
        if (loaded.request != session || !inSession) return;
        for (wire::Blob& blob : loaded.blobs) blobs.put(std::move(blob));
        if (!loaded.others.empty()) node.wantBlobs(loaded.others);
    }

    // One part of a change list a turn: where dozens of servers share a processor, a whole snapshot keeps a heartbeat
    // waiting for longer than a client believes in one.
    void decodeNext() {
        while (inSession && !incomingBusy && !frames.empty()) {
            event::FrameRequested& frame = frames.front();
            if (!decoding) {
                const auto complete = haveBlobs(frame);
                if (!complete) return node.endSession(complete.error().message);
                if (!*complete) return;
                blobsAsked = false;
                if (firstFrame && !frame.fromNothing) return node.endSession("a session's first frame is a snapshot");
                firstFrame = false;
                decoding.emplace();
                if (frame.fromNothing) decoding->draw.emptied = emptyScene();
            }
            if (decoding->parts < frame.changes.size()) {
                if (const auto applied = decoder->apply(frame.changes[decoding->parts], blobs); !applied)
                    return node.endSession(applied.error().message);
                if (++decoding->parts < frame.changes.size()) return pump.post([] {});
            }
            draw_task::Draw draw = std::move(decoding->draw);
            decoding.reset();
            draw.frame = frame.number;
            draw.from = &incoming;
            draw.views = std::move(frame.views);
            draw.time = frame.time;
            draw.wantPixels = frame.wantPixels;
            draw.wantCost = frame.wantCost;
            if (!frame.changes.empty()) draw.changes = incoming.commit();
            blobs.trim();
            frames.pop_front();
            incomingBusy = !draw.changes.empty() || !draw.emptied.empty();
            push(std::move(draw));
        }
    }

    // Destroys what is left of an earlier session, also what a broken change list left half done.
    ChangeList emptyScene() {
        RawEdit edit(incoming);
        for (const ContainerId id : incoming.ids()) edit.destroy(id);
        decoder.emplace(incoming);
        return incoming.commit();
    }

    // On the drawing thread, which listens to the client itself while it has nothing to draw: nobody has to wake it.
    DrawQueue::Entry nextTask() {
        for (;;) {
            if (auto task = queue.pop()) return std::move(*task);
            pump.wait([this] { return !queue.empty(); }, Duration::max());
        }
    }

    // An answer of the drawing thread, on that thread. What is short is written at once: waking the network thread for
    // it would take longer than drawing a small frame.
    void answer(std::uint64_t ofSession, DrawResult result) {
        if (std::holds_alternative<draw_result::Tiles>(result))
            return pump.post([this, ofSession, result = std::move(result)]() mutable { answered(ofSession, result); });
        pump.enter([&] { answered(ofSession, result); });
    }

    // Inside the pump.
    void answered(std::uint64_t ofSession, DrawResult& result) {
        if (std::holds_alternative<draw_result::Applied>(result)) {
            incomingBusy = false;  // whoever asked for it
            if (!frames.empty()) pump.post([] {});  // to be decoded there, while this one is drawn here
            return;
        }
        if (ofSession != session || !inSession) return;
        if (auto* ready = std::get_if<draw_result::Ready>(&result)) node.sendReady(ready->frame, ready->ready);
        else if (auto* shown = std::get_if<draw_result::Shown>(&result))
            node.reportSwap(shown->frame, shown->at);
        else if (auto* failed = std::get_if<draw_result::Failed>(&result)) node.sendFailed(failed->frame, failed->text);
        else if (auto* tiles = std::get_if<draw_result::Tiles>(&result)) node.sendTiles(tiles->frame, std::move(tiles->tiles));
        else if (auto* digests = std::get_if<draw_result::Digests>(&result)) node.sendDigests(digests->reply);
        else if (auto* text = std::get_if<draw_result::Explanation>(&result)) node.sendExplanation(text->text);
    }

    Result<void> run() {
        if (!options.blobCache.empty()) {
            auto folder = BlobFolder::open(options.blobCache, options.blobCacheBytes);
            if (!folder) return folder.error();
            librarian = std::make_unique<BlobLibrarian>(std::move(*folder), [this](BlobLibrarian::Loaded loaded) {
                pump.post([this, loaded = std::move(loaded)]() mutable { found(loaded); });
            });
        }
        if (options.dialHost.empty()) {
            const auto port = pump.listen(options.listenHost, options.listenPort);
            if (!port) return port.error();
            if (options.listening) options.listening(*port);
        }
        std::thread network([this] { pump.run(); });
        DrawThread drawing(
            types, renderer, [this] { return nextTask(); },
            [this](std::uint64_t of, DrawResult result) { answer(of, std::move(result)); });
        drawing.run();
        pump.post([this] {
            leaving = true;
            node.leave("the server is shutting down");
        });
        left.get_future().wait_for(std::chrono::seconds(2));  // last words need a moment to be written
        pump.stop();
        network.join();
        if (error) return *error;
        return {};
    }
};

RenderServer::RenderServer(RenderServerOptions options, const TypeRegistry& types, Renderer& renderer)
    : _implementation(std::make_unique<Implementation>(std::move(options), types, renderer)) {}

RenderServer::~RenderServer() = default;

Result<void> RenderServer::run() { return _implementation->run(); }

void RenderServer::stop() {
    _implementation->pump.post([this] { _implementation->queue.push({0, draw_task::Stop{}}); });
}

}  // namespace umbriel
