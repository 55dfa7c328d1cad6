#include "server/gl/workarounds.h"

#include <fmt/format.h>

#include <algorithm>

namespace umbriel::gl {
namespace {

// How a workaround is named where it is reported or switched off.
struct WorkaroundEntry {
    Workaround workaround;
    std::string_view name;
    std::string_view reason;
    std::string_view rendererContains;  // applies when GL_RENDERER contains this
};

// All that we know, in the order of the enumeration.
constexpr WorkaroundEntry kKnown[] = {
    {Workaround::LlvmpipeTimerQueriesLie, "mesa-llvmpipe-timer-queries-lie",
     "timer queries report when commands were queued, not when they ran; times are taken with glFinish and a clock",
     "llvmpipe"},
    {Workaround::LlvmpipeGathersConstants, "mesa-llvmpipe-gathers-constants",
     "fragment shaders gather uniform numbers pixel by pixel; constants of surfaces come from vertices", "llvmpipe"},
};

}  // namespace

Result<Workarounds> Workarounds::detect(const ContextInfo& info, std::span<const std::string> disabledNames) {
    for (const std::string& name : disabledNames) {
        if (std::ranges::any_of(kKnown, [&](const WorkaroundEntry& entry) { return entry.name == name; })) continue;
        std::string names;
        for (const WorkaroundEntry& entry : kKnown) names += fmt::format(" {}", entry.name);
        return badInput(fmt::format("there is no driver workaround \"{}\"; known:{}", name, names));
    }
    Workarounds result;
    for (const WorkaroundEntry& entry : kKnown) {
        if (info.renderer.find(entry.rendererContains) == std::string::npos) continue;
        const bool disabled = std::ranges::find(disabledNames, entry.name) != disabledNames.end();
        (disabled ? result._switchedOff : result._active).push_back(entry.workaround);
    }
    return result;
}

bool Workarounds::isActive(Workaround workaround) const {
    return std::ranges::find(_active, workaround) != _active.end();
}

std::vector<std::string> Workarounds::report() const {
    std::vector<std::string> lines;
    for (const WorkaroundEntry& entry : kKnown) {
        if (isActive(entry.workaround)) lines.push_back(fmt::format("{}: {}", entry.name, entry.reason));
        if (std::ranges::find(_switchedOff, entry.workaround) != _switchedOff.end())
            lines.push_back(fmt::format("{} (off): {}", entry.name, entry.reason));
    }
    return lines;
}

}  // namespace umbriel::gl
