#include "server/session/draw_thread.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/log.h"

namespace umbriel {

bool DrawQueue::push(Entry entry) {
    const std::lock_guard lock(_mutex);
    if (_entries.size() >= kLimit) return false;
    _entries.push_back(std::move(entry));
    return true;
}

std::optional<DrawQueue::Entry> DrawQueue::pop() {
    const std::lock_guard lock(_mutex);
    if (_entries.empty()) return std::nullopt;
    std::optional<Entry> entry(std::move(_entries.front()));
    _entries.pop_front();
    return entry;
}

bool DrawQueue::empty() const {
    const std::lock_guard lock(_mutex);
    return _entries.empty();
}

DrawThread::DrawThread(const TypeRegistry& types, Renderer& renderer, Next next, Answer answer)
    : _scene(types, _ids), _renderer(renderer), _next(std::move(next)), _answer(std::move(answer)) {}

void DrawThread::run() {
    while (!_stopped) {
        DrawQueue::Entry entry = _next();
        std::visit([&](auto& task) { perform(entry.session, task); }, entry.task);
    }
}

void DrawThread::follow(const ChangeList& changes, const Aspect& from) {
    if (changes.empty()) return;
    _scene.apply(changes, from);
    _digest.update(changes, _scene);
    _renderer.sceneChanged(changes, _scene);
}

void DrawThread::perform(std::uint64_t, draw_task::Assign& task) { _tiles = std::move(task.tiles); }

void DrawThread::perform(std::uint64_t session, draw_task::Draw& task) {
    follow(task.emptied, *task.from);
    follow(task.changes, *task.from);
    if (!task.emptied.empty() || !task.changes.empty()) _answer(session, draw_result::Applied{});
    if (task.views) _views = std::move(*task.views);
    const auto drawn = _renderer.draw(_scene, _views, _tiles, task.time);
    if (!drawn) return _answer(session, draw_result::Failed{task.frame, drawn.error().message});
    wire::Ready ready;
    ready.digest = _digest.total();
    ready.drawMilliseconds = drawn->drawMilliseconds;
    ready.triangles = drawn->triangles;
    ready.shadowTriangles = drawn->shadowTriangles;
    ready.nearestDepth = drawn->nearestDepth;
    ready.farthestDepth = drawn->farthestDepth;
    if (task.wantCost)
        ready.cost = wire::FrameCost{drawn->cpuMilliseconds, drawn->gpuMilliseconds, drawn->shadowMapBytes};
    _answer(session, draw_result::Ready{task.frame, ready});
    if (!task.wantPixels) return;
    auto tiles = _renderer.readTiles();
    if (!tiles) return _answer(session, draw_result::Failed{task.frame, tiles.error().message});
    _answer(session, draw_result::Tiles{task.frame, std::move(*tiles)});
}

void DrawThread::perform(std::uint64_t session, draw_task::Swap& task) {
    // Headless: what would be shown is what was drawn last.
    _shownFrame = task.frame;
    _answer(session, draw_result::Shown{task.frame, SteadyClock().now()});
    log::write(log::Level::Trace, fmt::format("shows frame {}", _shownFrame));
}

void DrawThread::perform(std::uint64_t session, draw_task::Digests& task) {
    wire::DigestReply reply;
    if (task.query.container) {
        if (const Container* container = _scene.find(task.query.container))
            for (std::uint32_t i = 0; i < container->type().fields.size(); ++i)
                reply.digests.emplace_back(i, _digest.ofField(task.query.container, i));
    } else {
        constexpr std::size_t kMost = wire::DigestReply::kMaxEntries;
        for (const auto& [id, digest] : _digest.containers(task.query.after, kMost + 1))
            reply.digests.emplace_back(id.value, digest);
        reply.more = reply.digests.size() > kMost;
        if (reply.more) reply.digests.pop_back();
    }
    _answer(session, draw_result::Digests{std::move(reply)});
}

void DrawThread::perform(std::uint64_t session, draw_task::Explain&) {
    _answer(session, draw_result::Explanation{_renderer.explain()});
}

void DrawThread::perform(std::uint64_t, draw_task::Stop&) { _stopped = true; }

}  // namespace umbriel
