#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "client/app/render_command.h"
#include "client/app/trade_setting.h"
#include "client/trade/frame_governor.h"
#include "client/trade/trade_choice.h"

namespace umbriel {

// --frame-budget: steps along the front that umbriel trade stored for the scene, so that frames stay within the budget.
// A step is an edit of the scene's viewports between two frames: every server draws the next one with it.
class FrameBudget {
 public:
    // Applies the first setting. Bad input when nothing was stored, or it cannot be used.
    static Result<FrameBudget> begin(const SceneArguments& arguments, Aspect& scene, Ref<Window> window);

    // After each frame's report.
    Result<void> follow(const FrameReport& report);
    // What the next frame is drawn with.
    const TradeSetting& setting() const { return _front[_governor.index()].setting; }

 private:
    FrameBudget(Aspect& scene, Ref<Window> window, std::vector<StoredTrade::Point> front, FrameGovernor governor)
        : _settings(scene, window), _front(std::move(front)), _governor(std::move(governor)) {}

    SettingSwitch _settings;
    std::vector<StoredTrade::Point> _front;
    FrameGovernor _governor;
};

}  // namespace umbriel
