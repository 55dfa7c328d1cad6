#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/wire/blob.h"

namespace umbriel {

// One attempt at one job. The same job may be tried again elsewhere; what an older attempt says is ignored. Numbers begin
// anew with every session, and a handler may outlive its own.
struct JobKey {
    std::uint64_t job = 0;
    std::uint32_t attempt = 0;
    std::uint64_t session = 0;
    friend auto operator<=>(const JobKey&, const JobKey&) = default;
};

// A job as the queue takes it, with everything it needs.
struct JobOffer {
    JobKey key;
    std::string kind;
    std::vector<std::byte> payload;
    Duration lease{};  // without a sign of life for this long the job is given up
    std::vector<wire::Blob> blobs{};  // all that it names
};

// News of a job, for the client.
struct JobEvent {
    enum class Kind { Lease, Done, Failed, Cancelled, Refused };
    Kind kind = Kind::Lease;
    JobKey key;
    float progress = 0.0f;          // Lease: 0..1
    std::string text;               // Failed, Refused: why
    std::vector<std::byte> result;  // Done
    Duration processor{};           // Done, Failed: what it cost, as far as its handler knows
};

// The states of jobs, without threads: queued -> running -> done, failed or cancelled. Every job that was offered ends in
// exactly one event that is not a lease. Bounded: what is beyond the limit is refused, the client offers it elsewhere.
class JobTable {
 public:
    explicit JobTable(std::size_t limit) : _limit(limit) {}

    // A newer attempt replaces an older one, which is cancelled; an older one is refused.
    void offer(JobOffer offer, bool kindIsKnown, TimePoint now);
    void cancel(JobKey key);
    void cancelAll();

    // The next job to work on; it is running from now on.
    std::optional<JobOffer> start(TimePoint now);
    // The work shows life. False when it should stop: the job was cancelled or given up, or was never started.
    bool alive(JobKey key, float progress, TimePoint now);
    // The work is over. Nothing happens when the job has ended otherwise, or was offered anew since and waits.
    void finish(JobKey key, Result<std::vector<std::byte>> result, Duration processor = {});
    // Gives up running jobs whose lease is over.
    void advance(TimePoint now);

    std::vector<JobEvent> takeEvents() { return std::exchange(_events, {}); }
    bool hasEvents() const { return !_events.empty(); }
    std::size_t size() const { return _jobs.size(); }

 private:
    struct Job {
        JobOffer offer;
        bool running = false;
        TimePoint deadline;     // of its lease; queued jobs wait without one
        TimePoint renewalDue;   // leases are renewed when a third of them has passed
    };
    void end(JobKey key, JobEvent::Kind kind, std::string text = {}, std::vector<std::byte> result = {},
             Duration processor = {});

    std::size_t _limit;
    std::map<JobKey, Job> _jobs;
    std::deque<JobKey> _order;  // queued ones
    std::vector<JobEvent> _events;
};

// What a handler knows of the job it works on.
class JobWork {
 public:
    virtual ~JobWork() = default;
    virtual std::span<const std::byte> payload() const = 0;
    virtual std::span<const wire::Blob> blobs() const = 0;
    // To be called several times per lease. False: stop, nobody wants the result any more.
    virtual bool alive(float progress) = 0;
    // What the job costs, where that is not what its own thread takes: others work for it.
    virtual void setProcessorTime(Duration cost) = 0;
};
using JobHandler = std::function<Result<std::vector<std::byte>>(JobWork&)>;

// Idle threads only get what the processor has left (SCHED_IDLE): drawing must not notice them. Normal ones compete, for
// servers that do nothing else.
enum class JobPriority { Idle, Normal };

// Works on jobs beside drawing, each on one thread. All functions may be called from any thread.
class JobQueue {
 public:
    static constexpr std::size_t kLimit = 256;

    // wake: called from any thread when takeEvents() has something new.
    JobQueue(std::map<std::string, JobHandler> handlers, std::function<void()> wake, int threads = 1,
             JobPriority priority = JobPriority::Idle);
    // Cancels everything and waits for running handlers to notice.
    ~JobQueue();
    JobQueue(const JobQueue&) = delete;
    JobQueue& operator=(const JobQueue&) = delete;

    void offer(JobOffer offer);
    void cancel(JobKey key);
    void cancelAll();
    // What happened since the last call; also notices leases that are over.
    std::vector<JobEvent> takeEvents();

 private:
    class Work;
    void work();

    JobPriority _priority;
    SteadyClock _clock;
    std::map<std::string, JobHandler> _handlers;
    std::function<void()> _wake;
    std::mutex _mutex;
    std::condition_variable _offered;
    JobTable _table{kLimit};
    bool _stopping = false;
    std::vector<std::thread> _threads;
};

}  // namespace umbriel
