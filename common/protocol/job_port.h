#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/wire/blob.h"
#include "common/wire/bytes.h"
#include "common/wire/messages.h"

namespace umbriel::protocol {

// One session with one server. A server that was lost and is back is another peer: it knows nothing of earlier jobs.
struct JobPeer {
    std::size_t server = 0;  // in the order of the cluster's servers
    std::uint32_t session = 0;
    friend bool operator==(const JobPeer&, const JobPeer&) = default;
};

// Work for a server (wire::JobOffer).
struct JobRequest {
    std::uint64_t job = 0;
    std::uint32_t attempt = 0;
    Duration lease{};
    std::string kind;
    wire::Bytes payload;
    std::vector<wire::BlobRef> blobs;  // of those that were provided
};

// What a client hears of its jobs.
struct JobNews {
    enum class Kind {
        Begun,  // a session; text: the server's name
        Ended,  // a session, and every job with it; text: why
        Lease,  // lease: the server works on a job
        Done,   // done: a job has ended, well or not; a result can be fetched
        Result  // result: fetched, its content bears its name
    };
    Kind kind = Kind::Begun;
    JobPeer peer;
    std::string text;
    wire::JobLease lease{};
    wire::JobDone done{};
    wire::Blob result{{}, MultiStorage(1)};
};

// Jobs on a cluster, beside its frames. From any one thread.
class JobPort {
 public:
    virtual ~JobPort() = default;
    virtual std::size_t serverCount() const = 0;
    // Contents that jobs may need, instead of those before; servers fetch what they lack. Sessions are announced from now
    // on, first those that exist; what was not waited for is forgotten. Returns how often this was called: to be part of
    // the numbers of jobs, so that late news of earlier ones are known as such.
    virtual std::uint32_t provide(std::vector<wire::Blob> blobs) = 0;
    // Nobody waits any more: contents and news are forgotten.
    virtual void finish() = 0;
    virtual void offer(JobPeer peer, JobRequest request) = 0;
    // Also lets go of a result that nobody fetches.
    virtual void cancel(JobPeer peer, std::uint64_t job, std::uint32_t attempt) = 0;
    virtual void fetch(JobPeer peer, const wire::BlobRef& result) = 0;
    // Waits for news, at most that long. An error when the cluster has ended.
    virtual Result<std::vector<JobNews>> wait(Duration most) = 0;
};

}  // namespace umbriel::protocol
