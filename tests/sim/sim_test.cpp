#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "tests/sim/simulation.h"

namespace umbriel::sim {
namespace {

std::uint64_t environmentNumber(const char* name, std::uint64_t otherwise) {
    const char* text = std::getenv(name);
    return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

std::string describe(std::uint64_t seed, const Outcome& outcome) {
    return "seed " + std::to_string(seed) + ": " + outcome.failure + "\n  (" + outcome.swarm +
           ")\n  replay: UMBRIEL_SIM_FIRST=" + std::to_string(seed) + " UMBRIEL_SIM_SEEDS=1";
}

// 1000 seeds by default; UMBRIEL_SIM_SEEDS and UMBRIEL_SIM_FIRST for more, or others.
TEST(Simulation, EveryPropertyHoldsForEverySeedAndEveryRarePathIsTaken) {
    const std::uint64_t first = environmentNumber("UMBRIEL_SIM_FIRST", 1);
    const std::uint64_t count = environmentNumber("UMBRIEL_SIM_SEEDS", 1000);
    Probes probes;
    std::uint64_t frames = 0, faults = 0, mostQueued = 0;
    double seconds = 0.0, longestHeal = 0.0, longestWait = 0.0;
    int failures = 0;
    for (std::uint64_t seed = first; seed < first + count && failures < 10; ++seed) {
        const Outcome outcome = simulate(seed);
        if (!outcome.failure.empty()) {
            ++failures;
            ADD_FAILURE() << describe(seed, outcome) << "\n  add this seed to tests/sim/seeds.txt";
        }
        // The same seed is the same run, or nothing above could be replayed.
        if (seed % 20 == 0) {
            EXPECT_EQ(simulate(seed).trace, outcome.trace) << "seed " << seed;
        }
        probes.add(outcome.probes);
        frames += outcome.frames;
        faults += outcome.faults;
        seconds += outcome.virtualSeconds;
        longestHeal = std::max(longestHeal, outcome.healSeconds);
        longestWait = std::max(longestWait, outcome.longestWaitSeconds);
        mostQueued = std::max(mostQueued, outcome.mostQueuedBytes);
    }
    std::printf(
        "%llu seeds, %.0f virtual s, %llu frames, %llu faults; longest wait %.3f s, longest time to be whole %.3f s, "
        "most bytes queued %llu\n",
        static_cast<unsigned long long>(count), seconds, static_cast<unsigned long long>(frames),
        static_cast<unsigned long long>(faults), longestWait, longestHeal, static_cast<unsigned long long>(mostQueued));
    for (std::size_t i = 0; i < kProbeNames.size(); ++i) {
        std::printf("  %8llu  %s\n", static_cast<unsigned long long>(probes.counts[i]),
                    std::string(kProbeNames[i]).c_str());
        if (count >= 1000 && failures == 0) {
            EXPECT_GT(probes.counts[i], 0u) << "never happened: " << kProbeNames[i];
        }
    }
}

// Every seed that ever failed.
TEST(Simulation, SeedsThatOnceFailedDoNotFailAgain) {
    std::ifstream file(UMBRIEL_SIM_SEED_FILE);
    ASSERT_TRUE(file) << UMBRIEL_SIM_SEED_FILE;
    std::string line;
    int seeds = 0;
    while (std::getline(file, line)) {
        if (line.empty() || line[0] == '#') continue;
        const std::uint64_t seed = std::strtoull(line.c_str(), nullptr, 10);
        const Outcome outcome = simulate(seed);
        EXPECT_EQ(outcome.failure, "") << describe(seed, outcome);
        ++seeds;
    }
    EXPECT_GT(seeds, 0);
}

struct PlantedBug {
    Planted planted;
    const char* name;
};
void PrintTo(const PlantedBug& bug, std::ostream* out) {
    *out << bug.name;
}
struct Bugs : testing::TestWithParam<PlantedBug> {};

TEST_P(Bugs, AreCaught) {
    constexpr std::uint64_t kMost = 200;
    for (std::uint64_t seed = 1; seed <= kMost; ++seed) {
        const Outcome outcome = simulate(seed, GetParam().planted);
        if (outcome.failure.empty()) continue;
        std::printf("%s is caught by seed %llu: %s\n", GetParam().name, static_cast<unsigned long long>(seed),
                    outcome.failure.c_str());
        return;
    }
    FAIL() << GetParam().name << " is not caught by " << kMost << " seeds";
}

INSTANTIATE_TEST_SUITE_P(Planted, Bugs,
                         testing::Values(PlantedBug{Planted::StaleSession, "a change list of an old session"},
                                         PlantedBug{Planted::ReadyEarly, "ready before it is drawn"},
                                         PlantedBug{Planted::NotEmptied, "a snapshot on top of an old scene"},
                                         PlantedBug{Planted::ShowsAtOnce, "a server that shows alone"},
                                         PlantedBug{Planted::ShowsWhatIsDrawn, "a swap that shows a late frame"},
                                         PlantedBug{Planted::IncompleteSnapshot, "a snapshot that lacks a container"},
                                         PlantedBug{Planted::ForgottenChange, "a change that is not sent"},
                                         PlantedBug{Planted::DeadlineIgnored, "a deadline that is ignored"},
                                         PlantedBug{Planted::NoRedial, "a server that is not reached again"}));

}  // namespace
}  // namespace umbriel::sim
