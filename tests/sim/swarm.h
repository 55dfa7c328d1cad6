#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "common/base/clock.h"
#include "common/protocol/failure_policy.h"
#include "tests/sim/random.h"

namespace umbriel::sim {

template <class Unit>
Duration randomDuration(Random& random, std::int64_t least, std::int64_t most) {
    return Unit(random.between(least, most));
}

// What one simulation is about (Groce et al. 2012, swarm testing): the wall, its network, and which faults there are at
// all.
struct Swarm {
    int servers = 1;
    protocol::FailurePolicy policy = protocol::FailurePolicy::Degrade;
    int latency = 0;
    bool split = false;
    bool pixels = false;
    bool startIncomplete = false;
    std::size_t window = 0;
    Duration leastLatency{}, mostLatency{};
    Duration leastDraw{}, mostDraw{};
    Duration think{};
    Duration safety{};
    Duration betweenFaults{};
    std::size_t historyFrames = 256;
    std::uint64_t historyBytes = 256 * 1024;
    bool pauses = false, silences = false, resets = false, restarts = false, slow = false, lethal = false;

    explicit Swarm(Random& random);
    // One line for a person.
    std::string text() const;
};

}  // namespace umbriel::sim
