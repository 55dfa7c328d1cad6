#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "common/protocol/clock_estimate.h"
#include "common/protocol/swap_skew.h"
#include "tests/support/virtual_wall.h"

namespace umbriel {
namespace {

using namespace std::chrono_literals;
using protocol::ClockEstimate;
using protocol::SwapSkew;

TimePoint at(Duration time) {
    return TimePoint(time);
}

// The peer's clock is 1 h ahead; there and back take these times, and it answers after 10 us.
ClockEstimate::Exchange exchange(TimePoint sent, Duration there, Duration back) {
    return {sent, sent + there + 1h, sent + there + 1h + 10us, sent + there + 10us + back};
}

TEST(ClockEstimate, OfEqualWaysIsExact) {
    ClockEstimate clock;
    EXPECT_FALSE(clock.ours(at(1h)));
    clock.add(exchange(at(5s), 100us, 100us));
    const auto time = clock.ours(at(1h + 5s));
    ASSERT_TRUE(time);
    EXPECT_EQ(time->at, at(5s));
    EXPECT_LE(time->bound, 101us);
}

// What the halves differ by shifts the estimate by half of that: at the worst by half of the way, which is the bound.
TEST(ClockEstimate, OfAWayInOneDirectionIsWrongByHalfOfIt) {
    for (const bool there : {true, false}) {
        ClockEstimate clock;
        const auto one = exchange(at(5s), there ? 300us : 0us, there ? 0us : 300us);
        clock.add(one);
        const auto time = clock.ours(one.peerReceived);
        ASSERT_TRUE(time);
        const Duration wrong = time->at - (one.peerReceived - 1h);
        EXPECT_EQ(wrong, there ? -150us : 150us);
        EXPECT_GE(time->bound, 150us);
        EXPECT_LE(time->bound, 151us);
    }
}

RC_GTEST_PROP(ClockEstimate, IsNeverFurtherOffThanItSays, ()) {
    const double drift = *rc::gen::inRange(-50, 51) * 1e-6;  // of one clock against the other: within kDrift
    const Duration ahead{*rc::gen::inRange<std::int64_t>(-1'000'000'000'000, 1'000'000'000'000)};
    const auto peer = [&](TimePoint ours) {
        return ours + ahead + Duration(std::llround(drift * static_cast<double>(ours.time_since_epoch().count())));
    };
    ClockEstimate clock;
    TimePoint now = at(1000s);
    for (int i = 0; i < 40; ++i) {
        const Duration there{*rc::gen::inRange(0, 5'000'000)}, back{*rc::gen::inRange(0, 5'000'000)};
        const TimePoint arrived = now + there, answered = arrived + 20us;
        clock.add({now, peer(arrived), peer(answered), answered + back});
        const TimePoint moment = now - Duration(*rc::gen::inRange<std::int64_t>(0, 2'000'000'000));
        const auto found = clock.ours(peer(moment));
        RC_ASSERT(found.has_value());
        RC_ASSERT(std::chrono::abs(found->at - moment) <= found->bound);
        now += 1s;
    }
}

TEST(ClockEstimate, TakesTheShortestWayAndIgnoresNonsense) {
    ClockEstimate clock;
    clock.add(exchange(at(1s), 40ms, 1ms));
    clock.add(exchange(at(1s), 10us, 10us));
    clock.add(exchange(at(1s), 80ms, 1ms));
    EXPECT_LE(clock.ours(at(1h + 1s))->bound, 12us);
    const auto before = clock.count();
    clock.add({at(2s), at(2s), at(1s), at(3s)});  // answered before it was asked
    clock.add({at(2s), at(1s), at(2s), at(1s)});  // received before it was sent
    clock.add({at(2s), at(1s), at(9s), at(3s)});  // kept longer than it was away
    EXPECT_EQ(clock.count(), before);
}

TEST(SwapSkew, IsTheSpreadOfThoseThatWereToldTogether) {
    SwapSkew skew;
    skew.told(1, {0, 1, 2});
    skew.shown(1, 0, {at(10ms), 5us});
    skew.shown(1, 7, {at(99ms), 5us});  // was not told
    skew.shown(1, 2, {at(12ms), 8us});
    EXPECT_EQ(skew.summary().frames, 0u) << "one has not reported";
    skew.shown(1, 1, {at(11ms), 5us});
    skew.shown(1, 1, {at(50ms), 5us});  // again
    EXPECT_EQ(skew.summary().frames, 1u);
    EXPECT_EQ(skew.summary().median, 2ms);
    EXPECT_EQ(skew.summary().bound, 16us) << "both ends may be off by the worst";
    skew.told(2, {0});
    skew.shown(2, 0, {at(10ms), 5us});
    EXPECT_EQ(skew.summary().frames, 1u) << "one alone cannot differ";
    for (std::uint64_t frame = 3; frame <= 101; ++frame) {
        skew.told(frame, {0, 1});
        skew.shown(frame, 0, {at(0ms), 0us});
        skew.shown(frame, 1, {at(frame * 1ms), 0us});
    }
    EXPECT_EQ(skew.summary().frames, 100u);
    EXPECT_EQ(skew.summary().median, 52ms);
    EXPECT_EQ(skew.summary().p99, 100ms);
    EXPECT_EQ(skew.summary().most, 101ms);
}

// Servers whose clocks show other times and run at other rates, behind a network whose ways differ: what is measured is
// what an observer who sees all clocks sees, within the stated bound.
TEST(SwapSkew, OfServersWithClocksOfTheirOwnIsTheTrueOneWithinItsBound) {
    for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
        net::MemoryNetwork::Options options;
        options.seed = seed;
        options.minLatency = 20us;
        options.maxLatency = 3ms;
        net::MemoryNetwork network(options);
        TypeRegistry types;
        registerCoreTypes(types);
        std::vector<std::string> names = {"left", "middle", "right"};
        std::vector<std::unique_ptr<test::VirtualServer>> servers;
        std::map<std::uint64_t, std::pair<TimePoint, TimePoint>> truth;  // frame: first and last
        for (std::size_t i = 0; i < names.size(); ++i) {
            auto& server = *servers.emplace_back(std::make_unique<test::VirtualServer>(names[i], types, network));
            network.listen(server.node, names[i], 7420);
            network.setClock(server.node, (static_cast<int>(i) - 1) * 1000h, 1.0 + (static_cast<int>(i) - 1) * 40e-6);
            server.whenSwapped = [&](std::uint64_t frame) {
                auto [entry, isNew] = truth.try_emplace(frame, network.now(), network.now());
                entry->second.second = network.now();
            };
        }
        test::VirtualClient client(test::VirtualClient::options("desk", types, names), types, network);
        ASSERT_TRUE(client.settle());
        for (int i = 0; i < 400; ++i) {
            client.begin();
            ASSERT_TRUE(client.settle());
            network.run(16ms);
        }
        client.client.askForClocks(network.now());
        network.poke(client.client);
        ASSERT_TRUE(network.runUntil([&] { return !client.client.waitsForClocks(); }, 1s));
        const auto skew = client.client.swapSkew();
        ASSERT_EQ(skew.frames, 400u);
        std::vector<Duration> expected;
        for (const auto& [frame, times] : truth) expected.push_back(times.second - times.first);
        std::sort(expected.begin(), expected.end());
        // Every frame's error is within the bound, so order statistics are, too.
        EXPECT_LE(std::chrono::abs(skew.median - expected[200]), skew.bound);
        EXPECT_LE(std::chrono::abs(skew.most - expected.back()), skew.bound);
        EXPECT_LE(skew.bound, 2 * (3ms + 100us * 16)) << "twice the longest way, and drift since the oldest exchange";
        EXPECT_GT(expected.back(), 1ms) << "there is something to measure";
    }
}

}  // namespace
}  // namespace umbriel
