#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "client/trade/trade_row.h"
#include "common/base/result.h"
#include "common/scene/aspect.h"
#include "common/scene/windows.h"

namespace umbriel {

// "lisp" or "std:scene": a mode this version draws, and how its map is fitted.
struct Technique {
    ShadowMode mode = ShadowMode::None;
    ShadowFitMode fit = ShadowFitMode::Union;
};
Result<Technique> parseTechnique(const std::string& text);

// What of a setting a technique has: a map of some size, a filter of some width, some number of samples.
bool hasMap(ShadowMode mode);
bool takesFilter(ShadowMode mode);
bool takesSamples(ShadowMode mode);

// Makes a window's viewports draw with one setting after another, each from the next frame on: fields of the scene, so
// all servers change at the same frame. What a setting sets beside technique and map size is put back before the next
// one. The scene must outlive this.
class SettingSwitch {
 public:
    SettingSwitch(Aspect& scene, Ref<Window> window) : _scene(&scene), _window(window) {}

    // Bad input for an unknown technique or field.
    Result<void> apply(const TradeSetting& setting);

 private:
    struct Kept {
        ContainerId viewport;
        std::uint32_t field = 0;
        std::vector<std::byte> value;
    };
    void keep(ContainerId viewport, std::string_view name);

    Aspect* _scene;
    Ref<Window> _window;
    std::vector<Kept> _kept;
};

// One setting, for good.
Result<void> applySetting(Aspect& scene, Ref<Window> window, const TradeSetting& setting);

}  // namespace umbriel
