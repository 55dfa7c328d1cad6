#include "client/bake/shard_coordinator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace umbriel {
namespace {

using namespace std::chrono_literals;
using protocol::JobPeer;
using Kind = ShardCoordinator::Order::Kind;

// The result that every honest server has of a shard.
Hash128 honest(std::size_t shard) {
    return {shard + 1, 77};
}

// A coordinator and what it ordered, on a clock that stands still until told otherwise. Server i has session 10 + i.
class Coordinator : public ::testing::Test {
 protected:
    void make(std::size_t servers, std::size_t shards, CoordinatorOptions options = {}) {
        if (options.auditShare == CoordinatorOptions{}.auditShare) options.auditShare = 0.0;
        options.lease = 30s;
        shardCount = shards;
        coordinator.emplace(options, servers, now);
    }
    static JobPeer peer(std::size_t server) { return {server, static_cast<std::uint32_t>(10 + server)}; }

    void take() {
        while (const auto order = coordinator->nextOrder()) {
            const std::size_t server = order->peer.server;
            switch (order->kind) {
                case Kind::Prepare:
                    prepares[server] = order->attempt;
                    break;
                case Kind::Bake:
                    offered[server].push_back({order->shard, order->attempt});
                    audits += order->audit;
                    break;
                case Kind::Cancel:
                    cancelled[server].insert({order->job - 1, order->attempt});
                    std::erase(offered[server], Offer{order->job - 1, order->attempt});
                    break;
                case Kind::Fetch:
                    fetches[server].push_back(order->result.hash);
                    break;
            }
        }
        for (const std::string& notice : coordinator->takeNotices()) notices += notice + "\n";
    }
    // A server that is ready at once.
    void join(std::size_t server, const std::string& bakeClass = "class", std::uint32_t slots = 1) {
        coordinator->sessionBegun(peer(server), "s" + std::to_string(server), now);
        coordinator->ready(peer(server), bakeClass, slots, now);
        take();
    }
    void begin(const std::vector<ShardCoordinator::Known>& known = {}) {
        coordinator->advance(now);
        ASSERT_FALSE(coordinator->bakeClass().empty());
        coordinator->start(known.empty() ? std::vector<ShardCoordinator::Known>(shardCount) : known, now);
        take();
    }
    void pass(Duration time) {
        now += time;
        coordinator->advance(now);
        take();
    }
    void lease(std::size_t server, std::size_t shard, std::uint32_t attempt) {
        coordinator->leased(peer(server), {ShardCoordinator::jobOf(shard), attempt, 0.5f}, now);
        take();
    }
    void finish(std::size_t server, std::size_t shard, std::uint32_t attempt, Hash128 result,
                wire::JobStatus status = wire::JobStatus::Done, const std::string& text = "") {
        std::erase(offered[server], Offer{shard, attempt});
        wire::JobDone done;
        done.job = ShardCoordinator::jobOf(shard);
        done.attempt = attempt;
        done.status = status;
        done.text = text;
        done.result = result;
        done.resultBytes = status == wire::JobStatus::Done ? 100 : 0;
        coordinator->jobDone(peer(server), done, now);
        take();
    }
    // What is to be fetched arrives and is sound.
    void deliver() {
        for (std::size_t server = 0; server < 16; ++server) {
            for (const Hash128& hash : std::exchange(fetches[server], {})) {
                const auto job = coordinator->fetched(peer(server), hash);
                if (!job) continue;
                if (coordinator->isDone(*job - 1)) {
                    coordinator->dissented(peer(server), *job - 1);
                    continue;
                }
                coordinator->stored(peer(server), *job - 1, now);
                ++stored[*job - 1];
            }
        }
        take();
    }
    // The server does the first of its jobs.
    bool work(std::size_t server) {
        if (offered[server].empty()) return false;
        const auto [shard, attempt] = offered[server].front();
        lease(server, shard, attempt);
        pass(1s);
        // It may have been taken away meanwhile.
        if (offered[server].empty() || offered[server].front() != Offer{shard, attempt}) return true;
        ++baked[server];
        finish(server, shard, attempt, honest(shard));
        deliver();
        return true;
    }
    void workAll(std::size_t servers) {
        for (int round = 0; round < 1000 && !coordinator->isFinished(); ++round)
            for (std::size_t i = 0; i < servers; ++i) work(i);
    }

    using Offer = std::pair<std::size_t, std::uint32_t>;
    std::optional<ShardCoordinator> coordinator;
    std::size_t shardCount = 0;
    TimePoint now{};
    std::map<std::size_t, std::uint32_t> prepares;
    std::map<std::size_t, std::vector<Offer>> offered;
    std::map<std::size_t, std::set<Offer>> cancelled;
    std::map<std::size_t, std::vector<Hash128>> fetches;
    std::map<std::size_t, int> stored;
    std::map<std::size_t, int> baked;
    int audits = 0;
    std::string notices;
};

TEST_F(Coordinator, EveryShardIsStoredOnceByServersThatShareTheWork) {
    make(3, 20);
    for (std::size_t i = 0; i < 3; ++i) join(i);
    begin();
    workAll(3);
    EXPECT_TRUE(coordinator->isFinished());
    EXPECT_FALSE(coordinator->error());
    EXPECT_EQ(stored.size(), 20u);
    for (const auto& [shard, times] : stored) EXPECT_EQ(times, 1) << shard;
    for (const auto& [server, count] : baked) EXPECT_GE(count, 5) << server;
    EXPECT_EQ(coordinator->redone(), 0u);
    EXPECT_EQ(coordinator->participants(), 3u);
}

TEST_F(Coordinator, WhatIsInFlightIsBoundedByTheServersSlots) {
    make(2, 100);
    join(0, "class", 1);
    join(1, "class", 4);
    begin();
    EXPECT_EQ(offered[0].size(), 3u);
    EXPECT_EQ(offered[1].size(), 6u);
    // Results that wait to be fetched count as well, and few are fetched at once.
    for (const Offer& offer : std::vector<Offer>(offered[1])) {
        lease(1, offer.first, offer.second);
        finish(1, offer.first, offer.second, honest(offer.first));
    }
    EXPECT_EQ(coordinator->inFlight(), 9u);
    EXPECT_EQ(fetches[1].size(), 4u);
    EXPECT_TRUE(offered[1].empty());
    deliver();
    EXPECT_EQ(fetches[1].size(), 2u);
    EXPECT_EQ(offered[1].size(), 4u);
}

TEST_F(Coordinator, ShardsOfALostServerAreGivenToOthers) {
    make(2, 4);
    join(0);
    join(1);
    begin();
    const auto lost = offered[0];
    lease(0, lost[0].first, lost[0].second);
    coordinator->sessionEnded(peer(0), "gone", now);
    take();
    EXPECT_EQ(coordinator->redone(), lost.size());
    EXPECT_NE(notices.find("'s0' is lost (gone): 2 of its shards"), std::string::npos) << notices;
    // Nothing that the old session says counts any more.
    finish(0, lost[0].first, lost[0].second, {666, 666});
    EXPECT_FALSE(coordinator->error());
    offered[0].clear();
    workAll(2);
    EXPECT_TRUE(coordinator->isFinished());
    EXPECT_FALSE(coordinator->error());
    EXPECT_EQ(stored.size(), 4u);
}

TEST_F(Coordinator, AServerThatComesLaterOrBackTakesWork) {
    make(2, 30);
    join(0);
    begin();
    work(0);
    join(1);
    EXPECT_FALSE(offered[1].empty());
    coordinator->sessionEnded(peer(0), "gone", now);
    offered[0].clear();
    coordinator->sessionBegun({0, 99}, "s0", now);
    take();
    EXPECT_EQ(prepares[0], 2u);
    coordinator->ready({0, 99}, "class", 1, now);
    take();
    EXPECT_FALSE(offered[0].empty());
}

TEST_F(Coordinator, ALeaseWithoutASignOfLifeIsGivenElsewhereAndItsLateResultIsWelcome) {
    make(2, 2);
    join(0);
    join(1);
    begin();
    const auto [shard, attempt] = offered[0].front();
    lease(0, shard, attempt);
    pass(29s);
    EXPECT_TRUE(cancelled[0].empty());
    pass(2s);
    EXPECT_TRUE(cancelled[0].contains({shard, attempt}));
    ASSERT_EQ(coordinator->redone(), 1u);
    // Meanwhile it has finished after all.
    finish(0, shard, attempt, honest(shard));
    deliver();
    workAll(2);
    EXPECT_TRUE(coordinator->isFinished());
    EXPECT_FALSE(coordinator->error());
    EXPECT_EQ(stored[shard], 1);
}

TEST_F(Coordinator, TwoResultsOfAShardThatDifferStopTheBake) {
    make(2, 1);
    join(0);
    join(1);
    begin();
    const auto [shard, attempt] = offered[0].front();
    lease(0, shard, attempt);
    pass(31s);  // given to the other one
    ASSERT_EQ(offered[1].size(), 1u);
    const auto again = offered[1].front();
    EXPECT_GT(again.second, attempt);
    finish(1, shard, again.second, honest(shard));
    finish(0, shard, attempt, {4, 4});
    EXPECT_FALSE(coordinator->error());
    // Whichever comes first counts.
    const auto late = std::exchange(fetches[0], {});
    deliver();
    EXPECT_EQ(stored[shard], 1);
    EXPECT_FALSE(coordinator->isFinished());
    fetches[0] = late;
    deliver();
    ASSERT_TRUE(coordinator->error());
    EXPECT_NE(coordinator->error()->message.find("shard 0 differs between server 's1' and server 's0'"),
              std::string::npos)
        << coordinator->error()->message;
    EXPECT_EQ(coordinator->disputedShard(), 0u);
}

TEST_F(Coordinator, AuditsAreDoneByAnotherServerAndComparedToTheBit) {
    make(2, 6, {.auditShare = 1.0});
    join(0);
    join(1);
    begin();
    workAll(2);
    EXPECT_TRUE(coordinator->isFinished());
    EXPECT_FALSE(coordinator->error()) << coordinator->error()->message;
    EXPECT_EQ(coordinator->audited(), 6u);
    EXPECT_EQ(audits, 6);
    for (const auto& [one, times] : stored) EXPECT_EQ(times, 1) << one;
}

TEST_F(Coordinator, AnAuditThatDiffersIsAnError) {
    make(2, 1, {.auditShare = 1.0});
    join(0);
    join(1);
    begin();
    ASSERT_TRUE(work(0));
    ASSERT_EQ(offered[1].size(), 1u);
    finish(1, 0, offered[1].front().second, {5, 5});
    deliver();
    ASSERT_TRUE(coordinator->error());
    EXPECT_EQ(coordinator->disputedShard(), 0u);
}

TEST_F(Coordinator, GarbageInAnAuditIsItsServersFault) {
    make(3, 1, {.auditShare = 1.0});
    for (std::size_t i = 0; i < 3; ++i) join(i);
    begin();
    ASSERT_TRUE(work(0));
    ASSERT_EQ(offered[1].size(), 1u);
    finish(1, 0, offered[1].front().second, {5, 5});
    ASSERT_TRUE(coordinator->fetched(peer(1), {5, 5}));
    coordinator->spoilt(peer(1), 0, "truncated");
    coordinator->advance(now);
    take();
    ASSERT_EQ(offered[2].size(), 1u);
    work(2);
    EXPECT_TRUE(coordinator->isFinished());
    EXPECT_FALSE(coordinator->error());
    EXPECT_EQ(coordinator->audited(), 1u);
}

TEST_F(Coordinator, OneServerAloneAuditsNothingAndSaysSo) {
    make(2, 2, {.auditShare = 1.0});
    join(0);
    begin();
    workAll(1);
    EXPECT_TRUE(coordinator->isFinished());
    EXPECT_FALSE(coordinator->error());
    EXPECT_EQ(coordinator->audited(), 0u);
    EXPECT_NE(notices.find("not audited"), std::string::npos);
}

TEST_F(Coordinator, TwoPercentOfTheShardsAreAudited) {
    make(1, 1, {.auditShare = 0.02 + 1e-12, .auditSeed = 3});
    int chosen = 0;
    for (std::size_t i = 0; i < 10000; ++i) chosen += coordinator->isAudited(i);
    EXPECT_NEAR(chosen, 200, 60);  // four standard deviations
}

TEST_F(Coordinator, TheFirstServerOfTheListDecidesTheClassAndOthersAreRefusedByName) {
    make(3, 3);
    coordinator->sessionBegun(peer(0), "s0", now);
    join(2, "other");
    EXPECT_TRUE(coordinator->bakeClass().empty());
    coordinator->ready(peer(0), "mine", 1, now);
    join(1, "mine");
    begin();
    EXPECT_EQ(coordinator->bakeClass(), "mine");
    EXPECT_TRUE(offered[2].empty());
    EXPECT_NE(notices.find("'s2' takes no part: it bakes in class \"other\""), std::string::npos) << notices;
    workAll(2);
    EXPECT_TRUE(coordinator->isFinished());
    EXPECT_FALSE(coordinator->error());
}

TEST_F(Coordinator, AResumedBakeKeepsItsClass) {
    make(2, 2, {.bakeClass = "mine"});
    join(0, "other");
    join(1, "mine");
    begin({{true, {}}, {}});
    EXPECT_TRUE(offered[0].empty());
    EXPECT_EQ(offered[1], (std::vector<Offer>{{1, 1}}));
    workAll(2);
    EXPECT_TRUE(coordinator->isFinished());
    EXPECT_EQ(stored.size(), 1u);
}

TEST_F(Coordinator, NobodyOfThisClassIsAnErrorThatNamesThem) {
    make(2, 2, {.bakeClass = "mine"});
    join(0, "other");
    join(1, "third");
    coordinator->advance(now);
    ASSERT_TRUE(coordinator->error());
    EXPECT_NE(coordinator->error()->message.find("'s0'"), std::string::npos);
    EXPECT_NE(coordinator->error()->message.find("\"third\""), std::string::npos) << coordinator->error()->message;
}

TEST_F(Coordinator, WhoeverKeepsTheBakeWaitingIsNamedNowAndThen) {
    make(3, 5);
    join(0);
    coordinator->sessionBegun(peer(1), "s1", now);
    pass(3s);
    begin();
    pass(10s);
    EXPECT_EQ(notices, "");
    pass(10s);
    EXPECT_NE(notices.find("server 's0' has 3 shards, server 's1' is getting ready, server 3 is not there"),
              std::string::npos)
        << notices;
    notices.clear();
    pass(10s);
    EXPECT_EQ(notices, "");
}

TEST_F(Coordinator, NoServerForTooLongIsAnError) {
    make(1, 2);
    join(0);
    begin();
    coordinator->sessionEnded(peer(0), "gone", now);
    pass(29s);
    EXPECT_FALSE(coordinator->error());
    pass(2s);
    EXPECT_TRUE(coordinator->error());
}

TEST_F(Coordinator, AServerThatFailsThriceInARowGetsNoMore) {
    make(2, 40);
    join(0);
    join(1);
    begin();
    int failures = 0;
    for (; failures < 10 && !offered[0].empty(); ++failures) {
        const auto [shard, attempt] = offered[0].front();
        finish(0, shard, attempt, {}, wire::JobStatus::Failed, "no memory");
        work(1);
    }
    EXPECT_EQ(failures, 3);
    EXPECT_NE(notices.find("'s0' gets no more work after 3 failures in a row: no memory"), std::string::npos)
        << notices;
    workAll(2);
    EXPECT_TRUE(coordinator->isFinished());
    EXPECT_FALSE(coordinator->error());
    EXPECT_EQ(stored.size(), 40u);
}

TEST_F(Coordinator, AShardThatFailsEverywhereIsReportedWhenTheOthersAreDone) {
    make(2, 5);
    join(0);
    join(1);
    begin();
    for (int round = 0; round < 200 && !coordinator->isFinished(); ++round) {
        for (std::size_t server = 0; server < 2; ++server) {
            if (offered[server].empty()) continue;
            const auto [shard, attempt] = offered[server].front();
            if (shard == 2)
                finish(server, shard, attempt, {}, wire::JobStatus::Failed, "cannot be");
            else
                work(server);
        }
    }
    EXPECT_EQ(stored.size(), 4u);
    ASSERT_TRUE(coordinator->error());
    EXPECT_NE(coordinator->error()->message.find("shard 2 has failed 3 times"), std::string::npos)
        << coordinator->error()->message;
}

TEST_F(Coordinator, GarbageCountsAgainstItsServerAndIsBakedElsewhere) {
    make(2, 1);
    join(0);
    join(1);
    begin();
    const auto [shard, attempt] = offered[0].front();
    finish(0, shard, attempt, {9, 9});
    ASSERT_EQ(fetches[0].size(), 1u);
    ASSERT_EQ(coordinator->fetched(peer(0), {9, 9}), ShardCoordinator::jobOf(shard));
    coordinator->spoilt(peer(0), shard, "it is not that shard");
    coordinator->advance(now);
    take();
    EXPECT_EQ(offered[1].size(), 1u);
    workAll(2);
    EXPECT_TRUE(coordinator->isFinished());
    EXPECT_FALSE(coordinator->error());
    // Fetched twice, or not asked for: nobody needs it.
    EXPECT_FALSE(coordinator->fetched(peer(0), {9, 9}));
}

TEST_F(Coordinator, AnIdleServerTakesWhatWaitsBehindOtherWork) {
    make(2, 3);
    join(0);
    begin();
    ASSERT_EQ(offered[0].size(), 3u);
    lease(0, offered[0][0].first, offered[0][0].second);
    join(1);
    EXPECT_FALSE(offered[1].empty());
    EXPECT_EQ(cancelled[0].size(), 1u);
    EXPECT_EQ(coordinator->redone(), 0u);
}

TEST_F(Coordinator, AShardThatTakesFarTooLongIsTriedElsewhereToo) {
    make(2, 5);
    join(0);
    join(1);
    begin();
    const auto [slow, attempt] = offered[0].front();
    lease(0, slow, attempt);
    for (int i = 0; i < 10; ++i) {
        work(1);
        lease(0, slow, attempt);
    }
    EXPECT_TRUE(coordinator->isFinished());
    EXPECT_TRUE(cancelled[0].contains({slow, attempt}));
    EXPECT_EQ(stored[slow], 1);
}

}  // namespace
}  // namespace umbriel
