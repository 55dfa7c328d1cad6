#pragma once

#include <chrono>
#include <cstdint>

#include "server/gl/object.h"

namespace umbriel::gl {

// Counts what happens between begin() and end(): GL_SAMPLES_PASSED, GL_PRIMITIVES_GENERATED, GL_TIME_ELAPSED (ns; but
// see Workaround::LlvmpipeTimerQueriesLie). At most one query per target runs at a time.
class Query {
 public:
    Query() = default;
    explicit Query(GLenum target);

    void begin();
    void end();
    // Waits until the result is there.
    uint64_t result() const;

    explicit operator bool() const { return static_cast<bool>(_name); }

 private:
    Name<deleteQuery> _name;
    GLenum _target = 0;
};

// Passes when the GPU has done everything that was queued before insert().
class Fence {
 public:
    // Empty: counts as passed.
    Fence() = default;
    // Queues a fence behind the commands so far.
    static Fence insert();

    Fence(Fence&& other) noexcept;
    Fence& operator=(Fence&& other) noexcept;
    Fence(const Fence&) = delete;
    Fence& operator=(const Fence&) = delete;
    ~Fence();

    // True when passed, false when the time ran out. Error: the driver lost the context.
    Result<bool> wait(std::chrono::nanoseconds timeout);

 private:
    GLsync _sync = nullptr;
#ifdef UMBRIEL_DEBUG
    const void* _context = nullptr;
#endif
};

}  // namespace umbriel::gl
