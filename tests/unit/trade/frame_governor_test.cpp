#include "client/trade/frame_governor.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

namespace umbriel {
namespace {

using Options = FrameGovernor::Options;

// A machine that takes `slowness` times what was measured; returns the steps that were taken.
int play(FrameGovernor& governor, const std::vector<double>& costs, double slowness, int frames) {
    int steps = 0;
    for (int i = 0; i < frames; ++i) steps += governor.observe(costs[governor.index()] * slowness) ? 1 : 0;
    return steps;
}

const std::vector<double> kFront = {5, 10, 20, 40, 80};

TEST(FrameGovernor, BeginsWithTheBestThatWasMeasuredWithinTheBudget) {
    EXPECT_EQ(FrameGovernor(kFront, {50.0}).index(), 3u);
    EXPECT_EQ(FrameGovernor(kFront, {41.0}).index(), 2u);  // 40 leaves no headroom
    EXPECT_EQ(FrameGovernor(kFront, {1.0}).index(), 0u);
    EXPECT_EQ(FrameGovernor(kFront, {1e9}).index(), 4u);
}

TEST(FrameGovernor, GoesDownAtOnceAsFarAsASlowerMachineNeeds) {
    FrameGovernor governor(kFront, {50.0});
    // Four times slower: 40 takes 160, 20 takes 80, 10 takes 40.
    EXPECT_EQ(play(governor, kFront, 4.0, 6), 1);
    EXPECT_EQ(governor.index(), 1u);
    EXPECT_EQ(play(governor, kFront, 4.0, 500), 0);  // 20 would take 80
}

TEST(FrameGovernor, GoesUpAfterPatienceWhenTheNextWouldFit) {
    FrameGovernor governor(kFront, {50.0});
    play(governor, kFront, 4.0, 20);
    ASSERT_EQ(governor.index(), 1u);
    EXPECT_EQ(play(governor, kFront, 1.0, 10), 0);  // 14 frames at 40 ms were within the budget, too: not yet 30
    play(governor, kFront, 1.0, 200);
    EXPECT_EQ(governor.index(), 3u);
}

TEST(FrameGovernor, OneLateFrameChangesNothing) {
    FrameGovernor governor(kFront, {50.0});
    for (int i = 0; i < 200; ++i) EXPECT_FALSE(governor.observe(i % 10 == 9 ? 500.0 : 40.0));
}

// What was measured promises more than the machine keeps: steps up are taken back, and tried ever more rarely.
TEST(FrameGovernor, DoesNotSwingBetweenTwoSettings) {
    const std::vector<double> measured = {10, 30};
    FrameGovernor governor(measured, {40.0});
    ASSERT_EQ(governor.index(), 1u);
    const auto real = [&] { return governor.index() == 0 ? 10.0 : 60.0; };
    int steps = 0;
    for (int i = 0; i < 5000; ++i) steps += governor.observe(real()) ? 1 : 0;
    EXPECT_LE(steps, 30);
    EXPECT_GE(steps, 3);
}

TEST(FrameGovernor, ASingleSettingStays) {
    FrameGovernor governor({10.0}, {1.0});
    EXPECT_EQ(play(governor, {10.0}, 3.0, 100), 0);
    EXPECT_EQ(governor.index(), 0u);
}

// On a machine of any speed it comes to rest at a setting that keeps the budget, if there is one.
RC_GTEST_PROP(FrameGovernor, ComesToRestWithinTheBudget, ()) {
    auto costs = *rc::gen::container<std::vector<double>>(
        6, rc::gen::map(rc::gen::inRange(1, 200), [](int v) { return 1.0 * v; }));
    std::sort(costs.begin(), costs.end());
    const double slowness = *rc::gen::inRange(1, 80) / 10.0;
    FrameGovernor governor(costs, {60.0});
    play(governor, costs, slowness, 3000);
    RC_ASSERT(play(governor, costs, slowness, 600) == 0);
    RC_ASSERT(governor.index() == 0 || costs[governor.index()] * slowness <= 60.0);
}

}  // namespace
}  // namespace umbriel
