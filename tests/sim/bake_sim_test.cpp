// A bake on virtual servers: the client's own code (coordinator, ledger, protocol) against model servers that keep the
// job table of real ones, on a network and a clock in memory, with the disk of this machine.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "client/bake/local_bake.h"
#include "tests/sim/bake_world.h"
#include "tests/support/temporary_folder.h"

namespace umbriel::sim {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using visibility::pixelCount;

std::string contentOf(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

class BakeSimulation : public ::testing::Test {
 protected:
    // Thousands of synced writes: in memory where that is possible.
    static fs::path fastest() {
        const fs::path memory = "/dev/shm";
        return ::access(memory.c_str(), W_OK) == 0 ? memory : fs::temp_directory_path();
    }
    ClusterBakeOptions to(const std::string& name, double audit = 0.0) const {
        ClusterBakeOptions options{.out = folder / name, .resume = true};
        options.coordinator.auditShare = audit;
        return options;
    }
    test::TemporaryFolder folder{fastest()};
};

TEST_F(BakeSimulation, AnyNumberOfServersMakesTheFileThatThreadsMake) {
    for (const std::size_t servers : {1u, 2u, 3u, 5u}) {
        BakeWorld world(servers, std::vector<Manner>(servers, Manner::Honest));
        const auto outcome = world.bake(to("maps.umvis", 0.5));
        ASSERT_TRUE(outcome) << outcome.error().message;
        EXPECT_EQ(contentOf(folder / "maps.umvis"), bakeSubject().whole);
        EXPECT_EQ(outcome->servers, servers);
        EXPECT_EQ(outcome->redone, 0u);
        EXPECT_EQ(outcome->rays, bakeSubject().mesh.rows.size() * pixelCount(bakeSubject().settings.mapping));
        EXPECT_GE(outcome->cpuSeconds, 0.001 * outcome->shards);
        EXPECT_EQ(outcome->audited > 0, servers > 1);
        EXPECT_LE(world.mostInFlight, 3 * servers);
        EXPECT_FALSE(fs::exists(folder / "maps.umvis.bake"));
    }
    const auto local =
        bakeLocally(bakeSubject().mesh, bakeSubject().settings, {.out = folder / "local.umvis", .threads = 1});
    ASSERT_TRUE(local);
    EXPECT_EQ(contentOf(folder / "local.umvis"), bakeSubject().whole);
}

// UMBRIEL_SIM_BAKES seeds (300): servers that are killed, paused, cut off, that stall, fail or send garbage, and a
// client that is killed and resumes. One server is honest.
TEST_F(BakeSimulation, WhateverHappensTheFileIsTheSame) {
    const char* wanted = std::getenv("UMBRIEL_SIM_BAKES");
    const int seeds = wanted ? std::atoi(wanted) : 300;
    int killed = 0, paused = 0, clients = 0;
    std::uint64_t redone = 0, audited = 0;
    double seconds = 0.0;
    for (int seed = 1; seed <= seeds; ++seed) {
        Random random(static_cast<std::uint64_t>(seed));
        std::vector<Manner> manners{Manner::Honest};
        const std::vector<Manner> others{Manner::Honest,  Manner::Honest,  Manner::OtherClass,
                                         Manner::Garbage, Manner::Failing, Manner::Stalling};
        while (manners.size() < 5 && random.chance(70))
            manners.push_back(others[static_cast<std::size_t>(random.between(0, 5))]);
        BakeWorld world(random.next(), manners);
        world.faults = random.chance(80);
        const std::string name = fmt::format("maps{}.umvis", seed);
        for (int life = 0;; ++life) {
            ASSERT_LT(life, 30) << "seed " << seed << " does not end";
            world.clientDiesAfter.reset();
            if (random.chance(50) && life < 5)
                world.clientDiesAfter = std::chrono::milliseconds(random.between(10, 4000));
            if (life > 10) world.faults = false;
            // Else the class would be whose server is there first.
            ClusterBakeOptions options = to(name, 0.2);
            options.coordinator.bakeClass = bakeSubject().baker->header().bakeClass;
            const auto outcome = world.bake(options);
            if (fs::exists(folder / name)) {
                EXPECT_EQ(contentOf(folder / name), bakeSubject().whole) << "seed " << seed;
            }
            if (outcome) {
                redone += outcome->redone;
                audited += outcome->audited;
                break;
            }
            ++clients;
            const std::string& message = outcome.error().message;
            // Only death, or nobody left at all, ends a bake.
            EXPECT_TRUE(message.find("killed") != std::string::npos || message.find("connect") != std::string::npos ||
                        message.find("reached") != std::string::npos ||
                        message.find("no server that bakes") != std::string::npos ||
                        message.find("none of the servers") != std::string::npos)
                << "seed " << seed << ": " << message;
        }
        EXPECT_EQ(contentOf(folder / name), bakeSubject().whole) << "seed " << seed;
        EXPECT_FALSE(fs::exists(folder / (name + ".bake"))) << "seed " << seed;
        killed += world.killed;
        paused += world.paused;
        seconds += toSeconds(world.now() - TimePoint{});
    }
    std::printf(
        "%d bakes in %.0f virtual s: %d servers killed, %d stopped, %d clients ended, %llu shards given out again, "
        "%llu audited\n",
        seeds, seconds, killed, paused, clients, static_cast<unsigned long long>(redone),
        static_cast<unsigned long long>(audited));
    EXPECT_GT(killed, seeds / 4);
    EXPECT_GT(clients, seeds / 4);
    EXPECT_GT(redone, 0u);
}

TEST_F(BakeSimulation, AServerThatLiesIsFoundByTheAuditAndHarmsNothing) {
    {
        BakeWorld world(3, {Manner::Honest, Manner::Liar});
        const auto outcome = world.bake(to("maps.umvis", 1.0));
        ASSERT_FALSE(outcome);
        EXPECT_NE(outcome.error().message.find("differs between"), std::string::npos) << outcome.error().message;
        EXPECT_NE(outcome.error().message.find("--resume"), std::string::npos) << outcome.error().message;
        EXPECT_FALSE(fs::exists(folder / "maps.umvis"));
    }
    // What it made before it was found is audited as well when the bake goes on, and made anew.
    BakeWorld world(4, {Manner::Honest, Manner::Honest});
    for (int attempt = 0; attempt < 20; ++attempt) {
        const auto outcome = world.bake(to("maps.umvis", 1.0));
        if (outcome) break;
        EXPECT_NE(outcome.error().message.find("an earlier run"), std::string::npos) << outcome.error().message;
    }
    EXPECT_EQ(contentOf(folder / "maps.umvis"), bakeSubject().whole);
}

TEST_F(BakeSimulation, OthersGoOnWithWhatAClusterHasBegunAndTheOtherWayRound) {
    BakeWorld world(5, {Manner::Honest, Manner::Honest});
    world.clientDiesAfter = 2s;
    ASSERT_FALSE(world.bake(to("maps.umvis")));
    const auto local = bakeLocally(bakeSubject().mesh, bakeSubject().settings,
                                   {.out = folder / "maps.umvis", .threads = 1, .resume = true});
    ASSERT_TRUE(local) << local.error().message;
    EXPECT_LT(local->rays, bakeSubject().mesh.rows.size() * pixelCount(bakeSubject().settings.mapping));
    EXPECT_EQ(contentOf(folder / "maps.umvis"), bakeSubject().whole);

    const auto stopped =
        bakeLocally(bakeSubject().mesh, bakeSubject().settings,
                    {.out = folder / "more.umvis", .threads = 1, .progress = [&](std::uint64_t, std::uint64_t) {
                         fs::create_directory(folder / "more.umvis");  // a folder in place of the file
                     }});
    ASSERT_FALSE(stopped);
    fs::remove(folder / "more.umvis");
    world.clientDiesAfter.reset();
    const auto resumed = world.bake(to("more.umvis"));
    ASSERT_TRUE(resumed) << resumed.error().message;
    EXPECT_EQ(resumed->rays, 0u);
    EXPECT_EQ(contentOf(folder / "more.umvis"), bakeSubject().whole);
}

// Servers finish work of the one that was given up while they are asked for the other's.
TEST_F(BakeSimulation, OneBakeAfterAnotherInTheSameSessions) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        BakeWorld world(seed, {Manner::Honest, Manner::Honest});
        const std::string name = fmt::format("maps{}.umvis", seed);
        Random random(seed);
        const auto outcomes = world.bakeInTurn({to("x" + name), to(name, 0.5), to("y" + name)},
                                               {std::chrono::milliseconds(random.between(100, 1000)), 1h, 1h});
        EXPECT_FALSE(outcomes[0]);
        for (const std::size_t i : {1u, 2u}) ASSERT_TRUE(outcomes[i]) << seed << ": " << outcomes[i].error().message;
        EXPECT_EQ(outcomes[1]->redone, 0u);
        EXPECT_EQ(contentOf(folder / name), bakeSubject().whole);
        EXPECT_EQ(contentOf(folder / ("y" + name)), bakeSubject().whole);
    }
}

TEST_F(BakeSimulation, TwoBakesIntoOneFileAndAnUnfinishedOneAreRefused) {
    BakeWorld world(6, {Manner::Honest});
    std::optional<Result<LocalBakeOutcome>> second;
    ClusterBakeOptions options = to("maps.umvis");
    options.progress = [&](std::uint64_t, std::uint64_t) {
        if (!second)
            second = bakeLocally(bakeSubject().mesh, bakeSubject().settings,
                                 {.out = folder / "maps.umvis", .threads = 1, .resume = true});
    };
    ASSERT_TRUE(world.bake(options));
    ASSERT_TRUE(second && !*second);
    EXPECT_NE(second->error().message.find("another bake"), std::string::npos) << second->error().message;
    EXPECT_EQ(contentOf(folder / "maps.umvis"), bakeSubject().whole);

    world.clientDiesAfter = 1500ms;
    ASSERT_FALSE(world.bake(to("more.umvis")));
    ASSERT_TRUE(fs::exists(folder / "more.umvis.bake"));
    world.clientDiesAfter.reset();
    ClusterBakeOptions anew = to("more.umvis");
    anew.resume = false;
    const auto refused = world.bake(anew);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, Error::Kind::BadInput);
    EXPECT_NE(refused.error().message.find("--resume"), std::string::npos) << refused.error().message;
}

}  // namespace
}  // namespace umbriel::sim
