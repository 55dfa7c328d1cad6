#pragma once

#include <cstdint>
#include <string>

#include "tests/sim/model_server.h"
#include "tests/sim/probes.h"

namespace umbriel::sim {

// What one seed did.
struct Outcome {
    std::string failure;      // empty: every property held
    std::uint64_t trace = 0;  // hash of everything that servers showed and that happened to them
    std::uint64_t frames = 0;
    std::uint64_t faults = 0;
    double virtualSeconds = 0.0;
    double longestWaitSeconds = 0.0;
    double healSeconds = 0.0;  // from the last fault until the wall was whole
    std::uint64_t mostQueuedBytes = 0;
    Probes probes;
    std::string swarm;  // what the seed drew, for people
};

// Client, 1 to 16 servers and network on one virtual clock. The seed draws the wall, the policy, the network and the
// faults. In the first phase servers are paused, slowed, cut off, reset, killed and started again; then all is mended
// and the wall must be whole within 2 s. Always: no server shows a frame but from the client's state, no frame waits
// beyond the policy, queues and histories stay within their bounds.
Outcome simulate(std::uint64_t seed, Planted planted = Planted::None);

}  // namespace umbriel::sim
