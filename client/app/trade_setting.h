#pragma once

#include <string>
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

// Makes a window's viewports draw with this setting from the next frame on: fields of the scene, so all servers change
// at the same frame. Bad input for an unknown technique or field.
Result<void> applySetting(Aspect& scene, Ref<Window> window, const TradeSetting& setting);

}  // namespace umbriel
