#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "common/base/result.h"
#include "server/bake/gl_maker.h"
#include "server/gl/context.h"

namespace umbriel {

// A GlMaker on a thread and in a context of its own, so that whoever bakes needs neither and what is drawn for the wall
// is not disturbed. The thread takes over the priority of the one that makes it, as do the driver's.
class GlWorker {
 public:
    // As GlMaker::create(), and failure when there is no OpenGL.
    static Result<std::unique_ptr<GlWorker>> create(const visibility::BakeMesh& mesh,
                                                    const visibility::Mapping& mapping, double farDistance,
                                                    const gl::ContextOptions& context = {});
    ~GlWorker();
    GlWorker(const GlWorker&) = delete;
    GlWorker& operator=(const GlWorker&) = delete;

    // The driver's name for what draws.
    const std::string& renderer() const;
    // As GlMaker::masks(). From any thread; one after the other.
    Result<void> masks(std::uint32_t firstRow, std::uint32_t rowCount, std::span<std::uint8_t> masks);

 private:
    struct State;
    explicit GlWorker(std::unique_ptr<State> state);
    std::unique_ptr<State> _state;
};

}  // namespace umbriel
