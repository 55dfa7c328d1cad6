#pragma once

#include <cstddef>
#include <deque>
#include <vector>

namespace umbriel {

// Keeps frames within a budget by stepping along a measured front of settings: cheaper when frames are late, more
// accurate when the next setting, scaled by what frames really take now, would fit. Steps happen between frames, on the
// client, so all servers draw a frame with the same setting. No clock: it is told what frames took.
class FrameGovernor {
 public:
    struct Options {
        double budgetMilliseconds = 40.0;
        std::size_t window = 5;     // frames whose median counts
        std::size_t patience = 30;  // frames within the budget before a step up
        double headroom = 0.85;     // a step up must be expected to take at most this share of the budget
    };
    // costs: milliseconds of the settings, ascending, at least one (asserted).
    FrameGovernor(std::vector<double> costs, const Options& options);

    // The setting for the next frame.
    std::size_t index() const { return _index; }
    // What a frame took that was drawn with index(). True when the setting changed.
    bool observe(double milliseconds);

 private:
    bool moveTo(std::size_t index);

    std::vector<double> _costs;
    Options _options;
    std::size_t _index;
    std::deque<double> _recent;  // since the last step, the first frame left out
    std::size_t _within = 0;     // frames in a row whose median was within the budget
    std::size_t _patience;       // grows when a step up had to be taken back
    bool _steppedUp = false;     // the last step
    bool _skipOne = false;
};

}  // namespace umbriel
