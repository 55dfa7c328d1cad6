#include "server/bake/job_queue.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <utility>

#include "common/base/processor_time.h"

namespace umbriel {

void JobTable::offer(JobOffer offer, bool kindIsKnown, TimePoint now) {
    const JobKey key = offer.key;
    const auto refuse = [&](std::string why) {
        _events.push_back({JobEvent::Kind::Refused, key, 0.0f, std::move(why), {}, {}});
    };
    if (!kindIsKnown) return refuse(fmt::format("this server does no jobs of kind '{}'", offer.kind));
    // All attempts of one job are neighbours in the map.
    for (auto other = _jobs.lower_bound({key.job, 0}); other != _jobs.end() && other->first.job == key.job;) {
        const JobKey known = (other++)->first;
        if (known.attempt >= key.attempt) return refuse(fmt::format("attempt {} of this job is here already", known.attempt));
        cancel(known);
    }
    if (_jobs.size() >= _limit) return refuse("this server has enough to do");
    Job job;
    job.offer = std::move(offer);
    job.deadline = TimePoint::max();
    job.renewalDue = now;
    _jobs.emplace(key, std::move(job));
    _order.push_back(key);
}

void JobTable::cancel(JobKey key) { end(key, JobEvent::Kind::Cancelled); }

void JobTable::cancelAll() {
    while (!_jobs.empty()) cancel(_jobs.begin()->first);
}

std::optional<JobOffer> JobTable::start(TimePoint now) {
    if (_order.empty()) return std::nullopt;
    Job& job = _jobs.at(_order.front());
    _order.pop_front();
    job.running = true;
    alive(job.offer.key, 0.0f, now);
    JobOffer offer = job.offer;
    return offer;
}

bool JobTable::alive(JobKey key, float progress, TimePoint now) {
    const auto found = _jobs.find(key);
    if (found == _jobs.end() || !found->second.running) return false;
    Job& job = found->second;
    if (now >= job.deadline) {
        end(key, JobEvent::Kind::Failed, "it showed no sign of life for a whole lease");
        return false;
    }
    job.deadline = now + job.offer.lease;
    if (now >= job.renewalDue) {
        job.renewalDue = now + job.offer.lease / 3;
        _events.push_back({JobEvent::Kind::Lease, key, std::clamp(progress, 0.0f, 1.0f), {}, {}, {}});
    }
    return true;
}

void JobTable::finish(JobKey key, Result<std::vector<std::byte>> result, Duration processor) {
    const auto found = _jobs.find(key);
    if (found == _jobs.end() || !found->second.running) return;
    if (result) end(key, JobEvent::Kind::Done, {}, std::move(*result), processor);
    else end(key, JobEvent::Kind::Failed, result.error().message, {}, processor);
}

void JobTable::advance(TimePoint now) {
    std::vector<JobKey> over;
    for (const auto& [key, job] : _jobs)
        if (job.running && now >= job.deadline) over.push_back(key);
    for (const JobKey key : over) end(key, JobEvent::Kind::Failed, "it showed no sign of life for a whole lease");
}

void JobTable::end(JobKey key, JobEvent::Kind kind, std::string text, std::vector<std::byte> result,
                   Duration processor) {
    if (_jobs.erase(key) == 0) return;
    std::erase(_order, key);
    _events.push_back({kind, key, 0.0f, std::move(text), std::move(result), processor});
}

class JobQueue::Work final : public JobWork {
 public:
    Work(JobQueue& queue, const JobOffer& offer) : _queue(queue), _offer(offer) {}
    std::span<const std::byte> payload() const override { return _offer.payload; }
    std::span<const wire::Blob> blobs() const override { return _offer.blobs; }
    bool alive(float progress) override {
        bool wanted = false;
        bool news = false;
        {
            const std::lock_guard lock(_queue._mutex);
            wanted = _queue._table.alive(_offer.key, progress, _queue._clock.now());
            news = _queue._table.hasEvents();
        }
        if (news) _queue._wake();
        return wanted;
    }
    void setProcessorTime(Duration cost) override { _cost = cost; }
    Duration costOr(Duration ofThread) const { return _cost.value_or(ofThread); }

 private:
    JobQueue& _queue;
    const JobOffer& _offer;
    std::optional<Duration> _cost;
};

JobQueue::JobQueue(std::map<std::string, JobHandler> handlers, std::function<void()> wake, int threads,
                   JobPriority priority)
    : _priority(priority), _handlers(std::move(handlers)), _wake(std::move(wake)) {
    for (int i = 0; i < std::max(1, threads); ++i) _threads.emplace_back([this] { work(); });
}

JobQueue::~JobQueue() {
    {
        const std::lock_guard lock(_mutex);
        _stopping = true;
        _table.cancelAll();
    }
    _offered.notify_all();
    for (std::thread& thread : _threads) thread.join();
}

void JobQueue::offer(JobOffer offer) {
    {
        const std::lock_guard lock(_mutex);
        const bool known = _handlers.count(offer.kind) != 0;
        _table.offer(std::move(offer), known, _clock.now());
    }
    _offered.notify_one();
    _wake();
}

void JobQueue::cancel(JobKey key) {
    {
        const std::lock_guard lock(_mutex);
        _table.cancel(key);
    }
    _wake();
}

void JobQueue::cancelAll() {
    {
        const std::lock_guard lock(_mutex);
        _table.cancelAll();
    }
    _wake();
}

std::vector<JobEvent> JobQueue::takeEvents() {
    const std::lock_guard lock(_mutex);
    _table.advance(_clock.now());
    return _table.takeEvents();
}

void JobQueue::work() {
    // Where the policy is not allowed the job merely runs at normal priority.
    const sched_param parameters{};
    if (_priority == JobPriority::Idle) ::pthread_setschedparam(::pthread_self(), SCHED_IDLE, &parameters);
    std::unique_lock lock(_mutex);
    for (;;) {
        std::optional<JobOffer> offer;
        _offered.wait(lock, [&] { return _stopping || (offer = _table.start(_clock.now())).has_value(); });
        if (_stopping) return;
        lock.unlock();
        _wake();
        Work work(*this, *offer);
        const Duration before = threadProcessorTime();
        auto result = _handlers.at(offer->kind)(work);
        const Duration processor = work.costOr(threadProcessorTime() - before);
        lock.lock();
        _table.finish(offer->key, std::move(result), processor);
        lock.unlock();
        _wake();
        lock.lock();
    }
}

}  // namespace umbriel
