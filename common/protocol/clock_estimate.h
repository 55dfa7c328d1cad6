#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "common/base/clock.h"

namespace umbriel::protocol {

// Where a peer's clock stands against ours, from messages that go there and back (Mills, RFC 5905, section 8): of the
// last exchanges the one with the shortest way counts. A way whose halves differ shifts the estimate by half of their
// difference, which is at most half of the way: that is the bound, and it holds for any network.
class ClockEstimate {
 public:
    // So much may two clocks drift apart while no exchange says more: two crystals of 50 parts in a million each.
    static constexpr double kDrift = 100e-6;

    // Sent and received on our clock, the peer's two times on its own.
    struct Exchange {
        TimePoint sent;
        TimePoint peerReceived;
        TimePoint peerSent;
        TimePoint received;
    };
    // An exchange that ended before it began, on either clock, is ignored.
    void add(const Exchange& exchange);
    std::size_t count() const { return _count; }

    struct Time {
        TimePoint at;    // on our clock
        Duration bound;  // the true time is no further away
    };
    // Of a moment on the peer's clock. Nothing before the first exchange.
    std::optional<Time> ours(TimePoint peerTime) const;

 private:
    struct Sample {
        TimePoint peerMiddle;  // of the exchange, on the peer's clock
        Duration ourLead{};    // our clock less the peer's
        Duration bound{};
    };
    std::array<Sample, 16> _last;
    std::size_t _count = 0;
};

}  // namespace umbriel::protocol
