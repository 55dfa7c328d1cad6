#include "server/bake/job_queue.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <atomic>
#include <latch>
#include <set>

#include "common/base/processor_time.h"
#include "server/bake/process_meter.h"
#include "tests/support/wait_until.h"

namespace umbriel {
namespace {

using namespace std::chrono_literals;
constexpr Duration kLong = std::chrono::hours(1);  // a lease that no load outlasts
using Kind = JobEvent::Kind;

JobOffer offerOf(std::uint64_t job, std::uint32_t attempt = 1, Duration lease = 3s) {
    return {{job, attempt}, "bake", std::vector<std::byte>(4, static_cast<std::byte>(job)), lease};
}

struct Table : testing::Test {
    ManualClock clock;
    JobTable table{3};
    std::vector<Kind> kinds() {
        std::vector<Kind> result;
        for (const JobEvent& event : table.takeEvents()) result.push_back(event.kind);
        return result;
    }
};

TEST_F(Table, JobsAreDoneInTheOrderTheyCame) {
    for (const std::uint64_t job : {7, 3, 5}) table.offer(offerOf(job), true, clock.now());
    for (const std::uint64_t job : {7, 3, 5}) {
        const auto next = table.start(clock.now());
        ASSERT_TRUE(next);
        EXPECT_EQ(next->key.job, job);
        table.finish(next->key, std::vector<std::byte>(1));
        EXPECT_EQ(kinds(), (std::vector{Kind::Lease, Kind::Done}));
    }
    EXPECT_FALSE(table.start(clock.now()));
}

TEST_F(Table, RefusesWhatIsTooMuchUnknownOrOld) {
    table.offer(offerOf(1), false, clock.now());
    EXPECT_EQ(kinds(), std::vector{Kind::Refused});
    for (const std::uint64_t job : {1, 2, 3}) table.offer(offerOf(job, 2), true, clock.now());
    EXPECT_TRUE(kinds().empty());
    table.offer(offerOf(4), true, clock.now());
    EXPECT_EQ(kinds(), std::vector{Kind::Refused}) << "more than the limit";
    table.offer(offerOf(1, 1), true, clock.now());
    EXPECT_EQ(kinds(), std::vector{Kind::Refused}) << "an older attempt";
    table.offer(offerOf(1, 3), true, clock.now());
    EXPECT_EQ(kinds(), std::vector{Kind::Cancelled}) << "a newer attempt takes over";
}

TEST_F(Table, ALeaseLastsAsLongAsThereAreSignsOfLife) {
    table.offer(offerOf(1), true, clock.now());
    const JobKey key = table.start(clock.now())->key;
    EXPECT_EQ(kinds(), std::vector{Kind::Lease});
    for (int i = 0; i < 10; ++i) {
        clock.advance(2900ms);
        EXPECT_TRUE(table.alive(key, 0.1f * static_cast<float>(i), clock.now()));
        EXPECT_EQ(kinds(), std::vector{Kind::Lease});
        EXPECT_TRUE(table.alive(key, 0.5f, clock.now()));
        EXPECT_TRUE(kinds().empty()) << "not renewed at every word";
    }
    clock.advance(3s);
    table.advance(clock.now());
    EXPECT_EQ(kinds(), std::vector{Kind::Failed});
    EXPECT_FALSE(table.alive(key, 1.0f, clock.now())) << "the handler is told to stop";
    table.finish(key, std::vector<std::byte>(1));
    EXPECT_TRUE(kinds().empty()) << "a late result is nobody's";
}

TEST_F(Table, AHandlerThatOutlivesItsJobHasNoSayWhenTheSameJobIsOfferedAgain) {
    const JobKey key{1, 1};
    table.offer(offerOf(1, 1), true, clock.now());
    ASSERT_TRUE(table.start(clock.now()));
    table.cancel(key);
    table.offer(offerOf(1, 1), true, clock.now());
    EXPECT_FALSE(table.alive(key, 0.5f, clock.now())) << "it is the new offer's turn, which was not started";
    table.finish(key, failure("stopped"));
    clock.advance(1h);
    table.advance(clock.now());
    EXPECT_TRUE(table.start(clock.now())) << "the new offer still waits, however long";
}

// Whatever happens to jobs, each ends exactly once.
RC_GTEST_PROP(JobTable, EveryJobEndsExactlyOnce, (const std::vector<std::uint32_t>& steps)) {
    ManualClock clock;
    JobTable table(8);
    std::multiset<JobKey> offered, ended;
    std::vector<JobKey> running;
    const auto collect = [&] {
        for (const JobEvent& event : table.takeEvents())
            if (event.kind != Kind::Lease) ended.insert(event.key);
    };
    for (const std::uint32_t step : steps) {
        const std::uint64_t job = step / 8 % 5;
        const std::uint32_t attempt = step / 40 % 4 + 1;
        switch (step % 8) {
            case 0: case 1: case 2:
                offered.insert({job, attempt});
                table.offer(offerOf(job, attempt), true, clock.now());
                break;
            case 3:
                if (const auto started = table.start(clock.now())) running.push_back(started->key);
                break;
            case 4:
                table.cancel({job, attempt});
                break;
            case 5:
                if (!running.empty()) table.finish(running[step % running.size()], failure("no"));
                break;
            case 6:
                clock.advance(std::chrono::milliseconds(step % 4000));
                table.advance(clock.now());
                break;
            default:
                if (!running.empty()) table.alive(running[step % running.size()], 0.5f, clock.now());
        }
    }
    table.cancelAll();
    collect();
    RC_ASSERT(table.size() == 0u);
    RC_ASSERT(offered == ended);
}

// Keeps the calling thread's processor busy for a while of its own time.
void burn(Duration time) {
    const Duration until = threadProcessorTime() + time;
    while (threadProcessorTime() < until) {
    }
}

// The thread around it: a handler gets its payload, its result comes back; one that is cancelled learns of it.
struct Queue : testing::Test {
    std::map<JobKey, JobEvent> ended;
    std::atomic<bool> sawStop = false;
    std::atomic<bool> looping = false;
    std::unique_ptr<JobQueue> queue;

    Queue() {
        std::map<std::string, JobHandler> handlers;
        handlers["reverse"] = [](JobWork& work) -> Result<std::vector<std::byte>> {
            return std::vector<std::byte>(work.payload().rbegin(), work.payload().rend());
        };
        handlers["loop"] = [this](JobWork& work) -> Result<std::vector<std::byte>> {
            while (work.alive(0.5f)) {
                looping = true;
                std::this_thread::sleep_for(1ms);
            }
            sawStop = true;
            return failure("stopped");
        };
        queue = std::make_unique<JobQueue>(std::move(handlers), [] {});
    }
    bool waitFor(const std::function<bool()>& condition) {
        return test::waitUntil([&] {
            for (JobEvent& event : queue->takeEvents())
                if (event.kind != Kind::Lease) ended[event.key] = std::move(event);
            return condition();
        });
    }
};

TEST_F(Queue, WorksOnJobsAndReturnsTheirResults) {
    queue->offer({{1, 1}, "reverse", {std::byte{1}, std::byte{2}}, kLong});
    queue->offer({{2, 1}, "unknown", {}, kLong});
    ASSERT_TRUE(waitFor([&] { return ended.size() == 2; }));
    EXPECT_EQ((ended[{1, 1}].result), (std::vector{std::byte{2}, std::byte{1}}));
    EXPECT_EQ((ended[{2, 1}].kind), Kind::Refused);
}

TEST_F(Queue, ACancelledJobStops) {
    queue->offer({{1, 1}, "loop", {}, kLong});
    queue->offer({{2, 1}, "reverse", {}, kLong});
    ASSERT_TRUE(waitFor([&] { return looping.load(); }));
    queue->cancel({1, 1});
    ASSERT_TRUE(waitFor([&] { return ended.size() == 2; }));
    EXPECT_EQ((ended[{1, 1}].kind), Kind::Cancelled);
    EXPECT_EQ((ended[{2, 1}].kind), Kind::Done);
    EXPECT_TRUE(sawStop);
}

TEST_F(Queue, SeveralThreadsWorkAtOnceAndAnOldSessionsHandlerHasNoSay) {
    std::atomic<int> waiting{0};
    std::atomic<bool> release{false};
    std::latch allThree{3};
    std::map<std::string, JobHandler> handlers;
    handlers["meet"] = [&](JobWork& work) -> Result<std::vector<std::byte>> {
        allThree.arrive_and_wait();  // nobody gets past it unless three run at once
        return std::vector<std::byte>(work.payload().begin(), work.payload().end());
    };
    handlers["deaf"] = [&](JobWork&) -> Result<std::vector<std::byte>> {
        ++waiting;
        while (!release) std::this_thread::sleep_for(1ms);
        return std::vector{std::byte{99}};
    };
    queue = std::make_unique<JobQueue>(
        std::move(handlers), [] {}, 3, JobPriority::Normal);
    for (std::uint64_t job = 1; job <= 3; ++job) queue->offer({{job, 1}, "meet", {std::byte(job)}, kLong});
    ASSERT_TRUE(waitFor([&] { return ended.size() == 3; }));
    for (std::uint64_t job = 1; job <= 3; ++job) EXPECT_EQ((ended[{job, 1}].result), std::vector{std::byte(job)});

    queue->offer({{7, 1, 1}, "deaf", {}, kLong});
    ASSERT_TRUE(waitFor([&] { return waiting == 1; }));
    queue->cancelAll();
    ASSERT_TRUE(waitFor([&] { return (ended.count({7, 1, 1}) != 0); }));
    EXPECT_EQ((ended[{7, 1, 1}].kind), Kind::Cancelled);
    // The same job and attempt of the next session runs beside it.
    queue->offer({{7, 1, 2}, "deaf", {}, kLong});
    ASSERT_TRUE(waitFor([&] { return waiting == 2; }));
    release = true;
    ASSERT_TRUE(waitFor([&] { return (ended.count({7, 1, 2}) != 0); }));
    EXPECT_EQ((ended[{7, 1, 2}].kind), Kind::Done);
    EXPECT_EQ((ended[{7, 1, 1}].kind), Kind::Cancelled);
    queue.reset();  // the first session's handler may still be on its way out, past what this scope holds
}

TEST_F(Queue, AJobCostsItsThreadsTimeOrWhatItsHandlerSays) {
    std::map<std::string, JobHandler> handlers;
    handlers["busy"] = [](JobWork&) -> Result<std::vector<std::byte>> {
        burn(5ms);
        return std::vector<std::byte>{};
    };
    handlers["employer"] = [](JobWork& work) -> Result<std::vector<std::byte>> {
        work.setProcessorTime(1234us);
        return std::vector<std::byte>{};
    };
    queue = std::make_unique<JobQueue>(std::move(handlers), [] {});
    queue->offer({{1, 1}, "busy", {}, kLong});
    queue->offer({{2, 1}, "employer", {}, kLong});
    ASSERT_TRUE(waitFor([&] { return ended.size() == 2; }));
    EXPECT_GE((ended[{1, 1}].processor), 5ms);
    EXPECT_EQ((ended[{2, 1}].processor), 1234us);
}

TEST(ProcessMeter, CountsWhatOtherThreadsDoAndNothingTwice) {
    ProcessMeter meter;
    const auto elsewhere = [] { std::thread([] { burn(10ms); }).join(); };
    elsewhere();
    const Duration before = processorTime();
    ProcessMeter::Span first(meter);
    elsewhere();
    ProcessMeter::Span second(meter);
    elsewhere();
    const Duration firstCost = first.end();
    elsewhere();
    const Duration secondCost = second.end();
    const Duration all = processorTime() - before;
    EXPECT_GE(firstCost, 20ms);
    EXPECT_GE(secondCost, 10ms);
    EXPECT_LE(firstCost + secondCost, all);
    elsewhere();
    const Duration idle = processorTime();
    ProcessMeter::Span third(meter);
    const Duration thirdCost = third.end();
    EXPECT_LE(thirdCost, processorTime() - idle) << "what passed without work is not counted";
}

TEST_F(Queue, EndsWhileAJobRuns) {
    queue->offer({{1, 1}, "loop", {}, kLong});
    ASSERT_TRUE(waitFor([&] { return looping.load(); }));
    queue.reset();
    EXPECT_TRUE(sawStop);
}

}  // namespace
}  // namespace umbriel
