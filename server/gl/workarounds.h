#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/gl/context.h"

namespace umbriel::gl {

// A known defect of a driver that our code steps around.
enum class Workaround {
    // GL_TIME_ELAPSED and GL_TIMESTAMP tell when commands were queued, not when they ran: 0.24 ms for a draw of 78 ms.
    // Measure with glFinish and a steady clock instead.
    LlvmpipeTimerQueriesLie,
    // Fragment shaders gather each number of a uniform block pixel by pixel, about 28 instructions for 8 pixels; flat
    // interpolants and blocks in vertex shaders are read at once (Mesa 22.3.6).
    LlvmpipeGathersConstants,
};

// The workarounds in force for one context.
class Workarounds {
 public:
    // Those that the renderer needs, less the disabled ones. Error (bad input): a disabled name that does not exist.
    static Result<Workarounds> detect(const ContextInfo& info, std::span<const std::string> disabledNames = {});

    bool isActive(Workaround workaround) const;
    // One line each: "NAME: reason", with "(off)" for the disabled ones that would apply.
    std::vector<std::string> report() const;

 private:
    std::vector<Workaround> _active;
    std::vector<Workaround> _switchedOff;
};

}  // namespace umbriel::gl
