#include "common/protocol/clock_estimate.h"

#include <algorithm>
#include <chrono>

namespace umbriel::protocol {

void ClockEstimate::add(const Exchange& exchange) {
    const Duration way = (exchange.received - exchange.sent) - (exchange.peerSent - exchange.peerReceived);
    if (exchange.received < exchange.sent || exchange.peerSent < exchange.peerReceived || way < Duration(0)) return;
    const Duration lead = ((exchange.sent - exchange.peerReceived) + (exchange.received - exchange.peerSent)) / 2;
    const TimePoint middle = exchange.peerReceived + (exchange.peerSent - exchange.peerReceived) / 2;
    // Rounded up: dividing by two cuts.
    _last[_count % _last.size()] = {middle, lead, way / 2 + Duration(1)};
    ++_count;
}

std::optional<ClockEstimate::Time> ClockEstimate::ours(TimePoint peerTime) const {
    std::optional<Time> best;
    for (std::size_t i = 0; i < std::min(_count, _last.size()); ++i) {
        const Sample& sample = _last[i];
        const Duration age = std::chrono::abs(peerTime - sample.peerMiddle);
        const Duration bound =
            sample.bound + Duration(static_cast<Duration::rep>(kDrift * static_cast<double>(age.count())) + 1);
        if (!best || bound < best->bound) best = Time{peerTime + sample.ourLead, bound};
    }
    return best;
}

}  // namespace umbriel::protocol
