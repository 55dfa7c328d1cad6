#include "server/bake/gl_worker.h"

#include <condition_variable>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace umbriel {

struct GlWorker::State {
    std::string renderer;
    std::mutex oneCaller;
    std::mutex mutex;
    std::condition_variable changed;
    std::function<Result<void>(GlMaker&)> work;  // empty: nothing to do
    std::optional<Result<void>> done;
    bool stopping = false;
    std::thread thread;

    // What is made on the thread is destroyed there.
    void run(const visibility::BakeMesh& mesh, const visibility::Mapping& mapping, double farDistance,
             const gl::ContextOptions& options, std::promise<Result<std::string>> ready) {
        auto context = gl::HeadlessContext::create(options);
        if (!context) return ready.set_value(context.error());
        auto maker = GlMaker::create(mesh, mapping, farDistance);
        if (!maker) return ready.set_value(maker.error());
        ready.set_value(context->info().renderer);
        std::unique_lock lock(mutex);
        for (;;) {
            changed.wait(lock, [&] { return stopping || work; });
            if (stopping) return;
            const auto now = std::exchange(work, {});
            lock.unlock();
            auto result = now(**maker);
            lock.lock();
            done = std::move(result);
            changed.notify_all();
        }
    }
};

GlWorker::GlWorker(std::unique_ptr<State> state) : _state(std::move(state)) {}

GlWorker::~GlWorker() {
    {
        const std::lock_guard lock(_state->mutex);
        _state->stopping = true;
    }
    _state->changed.notify_all();
    _state->thread.join();
}

Result<std::unique_ptr<GlWorker>> GlWorker::create(const visibility::BakeMesh& mesh, const visibility::Mapping& mapping,
                                                   double farDistance, const gl::ContextOptions& context) {
    auto state = std::make_unique<State>();
    std::promise<Result<std::string>> promise;
    auto ready = promise.get_future();
    state->thread =
        std::thread([&mesh, mapping, farDistance, context, s = state.get(), ready = std::move(promise)]() mutable {
            s->run(mesh, mapping, farDistance, context, std::move(ready));
        });
    auto renderer = ready.get();
    if (!renderer) {
        state->thread.join();
        return renderer.error();
    }
    state->renderer = std::move(*renderer);
    return std::unique_ptr<GlWorker>(new GlWorker(std::move(state)));
}

const std::string& GlWorker::renderer() const {
    return _state->renderer;
}

Result<void> GlWorker::masks(std::uint32_t firstRow, std::uint32_t rowCount, std::span<std::uint8_t> masks) {
    State& s = *_state;
    const std::lock_guard one(s.oneCaller);
    std::unique_lock lock(s.mutex);
    s.done.reset();
    s.work = [=](GlMaker& maker) { return maker.masks(firstRow, rowCount, masks); };
    s.changed.notify_all();
    s.changed.wait(lock, [&] { return s.done.has_value(); });
    return *s.done;
}

}  // namespace umbriel
