#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/clock.h"
#include "common/scene/aspect.h"
#include "common/scene/digest.h"
#include "common/wire/messages.h"
#include "server/draw/renderer.h"

namespace umbriel {

// What the network thread asks of the drawing thread.
namespace draw_task {
// Other tiles from the next frame on.
struct Assign {
    std::vector<TileAssignment> tiles;
};
// Apply the changes and draw the tiles. time: seconds.
struct Draw {
    std::uint64_t frame = 0;
    ChangeList emptied;            // destroys what an earlier session left; applied first
    ChangeList changes;
    const Aspect* from = nullptr;  // where the changes' values are; not edited until they are applied
    std::optional<WallViews> views;
    double time = 0.0;
    bool wantPixels = false;
    bool wantCost = false;
};
// Show this frame, which was ready.
struct Swap {
    std::uint64_t frame = 0;
};
struct Digests {
    wire::DigestQuery query;
};
struct Explain {};
struct Stop {};
}  // namespace draw_task
using DrawTask = std::variant<draw_task::Assign, draw_task::Draw, draw_task::Swap, draw_task::Digests, draw_task::Explain,
                              draw_task::Stop>;

// What it answers.
namespace draw_result {
struct Applied {};  // there were changes; those of the next frame may be decoded
// The frame is drawn and waits to be shown.
struct Ready {
    std::uint64_t frame = 0;
    wire::Ready ready;
};
// It is shown, since then.
struct Shown {
    std::uint64_t frame = 0;
    TimePoint at;
};
// It could not be drawn: why, for people.
struct Failed {
    std::uint64_t frame = 0;
    std::string text;
};
// The pixels of a frame that they were asked for.
struct Tiles {
    std::uint64_t frame = 0;
    std::vector<TilePixels> tiles;
};
struct Digests {
    wire::DigestReply reply;
};
// How the renderer draws, for people.
struct Explanation {
    std::string text;
};
}  // namespace draw_result
using DrawResult = std::variant<draw_result::Applied, draw_result::Ready, draw_result::Shown, draw_result::Failed,
                                draw_result::Tiles, draw_result::Digests, draw_result::Explanation>;

// Tasks for the drawing thread, in order. Bounded: the protocol allows few frames under way, so more is our own error.
class DrawQueue {
 public:
    struct Entry {
        std::uint64_t session = 0;  // which one it belongs to; answers carry it back
        DrawTask task;
    };
    static constexpr std::size_t kLimit = 1024;

    // False when the queue is full. From any thread.
    bool push(Entry entry);
    // Nothing when it is empty. From any thread.
    std::optional<Entry> pop();
    bool empty() const;

 private:
    mutable std::mutex _mutex;
    std::deque<Entry> _entries;
};

// The drawing half of a render server: owns the aspect that is drawn, its digest and what is shown. Lives on the thread
// that has the renderer's context.
class DrawThread {
 public:
    // Waits for the next task.
    using Next = std::function<DrawQueue::Entry()>;
    using Answer = std::function<void(std::uint64_t session, DrawResult result)>;

    DrawThread(const TypeRegistry& types, Renderer& renderer, Next next, Answer answer);
    // Works until a Stop task.
    void run();

 private:
    void perform(std::uint64_t session, draw_task::Assign& task);
    void perform(std::uint64_t session, draw_task::Draw& task);
    void perform(std::uint64_t session, draw_task::Swap& task);
    void perform(std::uint64_t session, draw_task::Digests& task);
    void perform(std::uint64_t session, draw_task::Explain& task);
    void perform(std::uint64_t session, draw_task::Stop& task);
    void follow(const ChangeList& changes, const Aspect& from);

    IdSource _ids;
    Aspect _scene;
    StateDigest _digest;
    Renderer& _renderer;
    Next _next;
    Answer _answer;
    std::vector<TileAssignment> _tiles;
    WallViews _views;
    std::uint64_t _shownFrame = 0;
    bool _stopped = false;
};

}  // namespace umbriel
