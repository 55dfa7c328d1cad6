#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/protocol/clock_estimate.h"

namespace umbriel::protocol {

// How far apart the servers that were told together showed the frames.
class SwapSkew {
 public:
    // The last frames whose servers have all reported; older ones are left out.
    struct Summary {
        std::size_t frames = 0;
        Duration median{};
        Duration p99{};
        Duration most{};
        Duration bound{};  // no frame's true skew is further away from the measured one
    };

    // These servers were told to show it now. Fewer than two cannot differ.
    void told(std::uint64_t frame, std::vector<std::size_t> servers);
    void shown(std::uint64_t frame, std::size_t server, const ClockEstimate::Time& time);
    Summary summary() const;

 private:
    struct Frame {
        std::vector<std::size_t> waitingFor;
        TimePoint first = TimePoint::max();
        TimePoint last = TimePoint::min();
        Duration bound{};  // the largest of a single time
    };
    struct Measured {
        Duration skew;
        Duration bound;
    };
    std::map<std::uint64_t, Frame> _open;
    std::vector<Measured> _measured;  // a ring
    std::size_t _count = 0;
};

}  // namespace umbriel::protocol
