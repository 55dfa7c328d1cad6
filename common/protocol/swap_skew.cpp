#include "common/protocol/swap_skew.h"

#include <algorithm>
#include <utility>

namespace umbriel::protocol {

namespace {

// Frames that wait for reports, which come with heartbeats; and frames that a summary speaks of.
constexpr std::size_t kMaxOpen = 1024;
constexpr std::size_t kMaxMeasured = 16'384;

}  // namespace

void SwapSkew::told(std::uint64_t frame, std::vector<std::size_t> servers) {
    if (servers.size() < 2) return;
    _open[frame].waitingFor = std::move(servers);
    if (_open.size() > kMaxOpen) _open.erase(_open.begin());
}

void SwapSkew::shown(std::uint64_t number, std::size_t server, const ClockEstimate::Time& time) {
    const auto found = _open.find(number);
    if (found == _open.end() || std::erase(found->second.waitingFor, server) == 0) return;
    Frame& frame = found->second;
    frame.first = std::min(frame.first, time.at);
    frame.last = std::max(frame.last, time.at);
    frame.bound = std::max(frame.bound, time.bound);
    if (!frame.waitingFor.empty()) return;
    // Both ends may be off.
    const Measured measured{frame.last - frame.first, 2 * frame.bound};
    if (_measured.size() < kMaxMeasured)
        _measured.push_back(measured);
    else
        _measured[_count % kMaxMeasured] = measured;
    ++_count;
    _open.erase(found);
}

SwapSkew::Summary SwapSkew::summary() const {
    Summary summary;
    summary.frames = _measured.size();
    if (_measured.empty()) return summary;
    std::vector<Duration> skews;
    for (const Measured& one : _measured) {
        skews.push_back(one.skew);
        summary.bound = std::max(summary.bound, one.bound);
    }
    std::sort(skews.begin(), skews.end());
    summary.median = skews[skews.size() / 2];
    summary.p99 = skews[(skews.size() * 99 + 99) / 100 - 1];
    summary.most = skews.back();
    return summary;
}

}  // namespace umbriel::protocol
