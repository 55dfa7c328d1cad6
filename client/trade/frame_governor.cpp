#include "client/trade/frame_governor.h"

#include <algorithm>

#include "common/base/assert.h"

namespace umbriel {
namespace {

// Patience doubles with every step up that was taken back, up to this many times the first.
constexpr std::size_t kMostPatience = 16;

}  // namespace

FrameGovernor::FrameGovernor(std::vector<double> costs, const Options& options)
    : _costs(std::move(costs)), _options(options), _index(0), _patience(options.patience) {
    UMBRIEL_ASSERT(!_costs.empty() && std::is_sorted(_costs.begin(), _costs.end()), "a front is ascending by cost");
    UMBRIEL_ASSERT(options.window > 0, "a median is of something");
    // The most accurate that fits as it was measured.
    while (_index + 1 < _costs.size() && _costs[_index + 1] <= options.headroom * options.budgetMilliseconds) ++_index;
}

bool FrameGovernor::moveTo(std::size_t index) {
    _index = index;
    _recent.clear();
    _within = 0;
    _skipOne = true;  // the first frame makes maps and compiles shaders
    return true;
}

bool FrameGovernor::observe(double milliseconds) {
    if (_skipOne) {
        _skipOne = false;
        return false;
    }
    _recent.push_back(milliseconds);
    if (_recent.size() > _options.window) _recent.pop_front();
    if (_recent.size() < _options.window) return false;
    std::vector<double> sorted(_recent.begin(), _recent.end());
    std::sort(sorted.begin(), sorted.end());
    const double median = sorted[sorted.size() / 2];
    if (median > _options.budgetMilliseconds) {
        _within = 0;
        if (_index == 0) return false;
        if (_steppedUp)
            _patience = std::min(2 * _patience, kMostPatience * std::max<std::size_t>(1, _options.patience));
        _steppedUp = false;
        // As far down as this machine, at its present speed, needs.
        const double slower = _costs[_index] > 0.0 ? median / _costs[_index] : 1.0;
        std::size_t next = _index - 1;
        while (next > 0 && _costs[next] * slower > _options.budgetMilliseconds) --next;
        return moveTo(next);
    }
    if (++_within < _patience || _index + 1 == _costs.size()) return false;
    const double expected = _costs[_index] > 0.0 ? _costs[_index + 1] * (median / _costs[_index]) : _costs[_index + 1];
    if (expected > _options.headroom * _options.budgetMilliseconds) return false;
    _steppedUp = true;
    return moveTo(_index + 1);
}

}  // namespace umbriel
