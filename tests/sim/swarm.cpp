#include "tests/sim/swarm.h"

#include <fmt/format.h>

#include <chrono>
#include <utility>

namespace umbriel::sim {

using protocol::FailurePolicy;

Swarm::Swarm(Random& random) {
    servers = static_cast<int>(random.chance(30) ? random.between(1, 16) : random.between(1, 6));
    const auto draw = random.between(0, 9);
    policy = draw < 6 ? FailurePolicy::Degrade : draw < 8 ? FailurePolicy::Strict : FailurePolicy::Wait;
    latency = random.chance(40) ? 1 : 0;
    split = random.chance(30);
    pixels = random.chance(30);
    startIncomplete = policy != FailurePolicy::Wait && random.chance(15);
    if (random.chance(40)) window = static_cast<std::size_t>(random.between(2, 64)) * 1024;
    leastLatency = randomDuration<std::chrono::microseconds>(random, 20, 200);
    mostLatency = leastLatency + randomDuration<std::chrono::microseconds>(random, 0, random.chance(20) ? 5000 : 300);
    leastDraw = randomDuration<std::chrono::microseconds>(random, 500, 8000);
    mostDraw = leastDraw + randomDuration<std::chrono::microseconds>(random, 0, 8000);
    think = randomDuration<std::chrono::milliseconds>(random, 5, 80);
    safety = randomDuration<std::chrono::milliseconds>(random, 2500, 7000);
    betweenFaults = randomDuration<std::chrono::milliseconds>(random, 20, 800);
    if (random.chance(40)) historyFrames = static_cast<std::size_t>(random.between(1, 12));
    pauses = random.chance(50);
    silences = random.chance(50);
    resets = random.chance(50);
    restarts = random.chance(50);
    slow = random.chance(50);
    lethal = random.chance(30);
}

std::string Swarm::text() const {
    const char* names[] = {"wait", "strict", "degrade"};
    std::string faults;
    for (const auto& [on, name] : {std::pair{pauses, "pauses"},
                                   {silences, "silences"},
                                   {resets, "resets"},
                                   {restarts, "restarts"},
                                   {slow, "slow"},
                                   {lethal, "lethal"}})
        if (on) faults += std::string(" ") + name;
    return fmt::format(
        "{} servers, {}, latency {}, network {:.2f}..{:.2f} ms{}{}, draw {:.1f}..{:.1f} ms, think {} ms{}{}, "
        "faults:{}",
        servers, names[static_cast<int>(policy)], latency, toMilliseconds(leastLatency), toMilliseconds(mostLatency),
        split ? ", split reads" : "", window ? fmt::format(", window {} KiB", window / 1024) : "",
        toMilliseconds(leastDraw), toMilliseconds(mostDraw), toMilliseconds(think), pixels ? ", pixels" : "",
        startIncomplete ? ", starts incomplete" : "", faults.empty() ? " none" : faults);
}

}  // namespace umbriel::sim
