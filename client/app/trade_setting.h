#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/trade/trade_row.h"
#include "common/base/result.h"
#include "common/scene/aspect.h"
#include "common/scene/windows.h"

namespace umbriel {

// "lisp", "std:scene" or "light-map:pcf": a mode this version draws, and how its map is fitted, or what a light map is
// baked from.
struct Technique {
    ShadowMode mode = ShadowMode::None;
    std::optional<ShadowFitMode> fit{};     // where it is named
    std::optional<ShadowMode> bakedFrom{};  // of a light map; none: rays
};
Result<Technique> parseTechnique(const std::string& text);
// The parts between commas; none of an empty text.
std::vector<std::string> listOf(const std::string& text);

// What of a setting a technique has: a map of some size, a filter of some width, some number of samples.
bool hasMap(ShadowMode mode);
bool takesFilter(ShadowMode mode);
bool takesSamples(ShadowMode mode);
// Whether it draws with a light map, whatever that is baked from.
bool isLightMap(const TradeSetting& setting);

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
