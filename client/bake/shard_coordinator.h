#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "common/base/hash.h"
#include "common/base/result.h"
#include "common/protocol/job_port.h"

namespace umbriel {

// How long the coordinator waits for whom, and how much it has baked twice to compare.
struct CoordinatorOptions {
    // Of a shard: so long without a sign of life. A dead server is known by its silence; this is for one whose work
    // hangs, and must not take starving for that: idle threads on a busy machine get a thousandth of a processor.
    Duration lease = std::chrono::minutes(2);
    Duration prepareLease = std::chrono::minutes(30);  // of mesh and tree, which show none while they are built
    Duration classPatience = std::chrono::seconds(3);  // for servers that get ready after the first
    Duration patience = std::chrono::seconds(30);      // without any server that bakes
    Duration reminder = std::chrono::seconds(20);      // says what is waited for when nothing has happened for so long
    double auditShare = 0.02;                          // of the shards, baked again by another server
    std::uint64_t auditSeed = 0;                       // decides which
    std::string bakeClass{};                           // of what is done already; empty: decided here
};

// Who bakes which shard on a cluster: a state machine without threads, sockets, disk or a clock of its own. Shards are
// leased to servers that are ready, a few ahead of what each works on. A lease ends with its session or without a sign
// of life; the shard is then given out again, as often as it takes. A shard that fails by itself is tried three times
// and on every server; a server that fails three times in a row gets no more. A shard is a pure function, so whichever
// attempt brings it first counts, and another that differs is an error: the bake stops. When nothing is left to give
// out, an idle server takes over what waits elsewhere or takes far longer than usual, and does the audits.
class ShardCoordinator {
 public:
    static constexpr std::uint64_t kPrepareJob = 0;
    static std::uint64_t jobOf(std::size_t shard) { return shard + 1; }

    struct Order {
        enum class Kind { Prepare, Bake, Cancel, Fetch };
        Kind kind = Kind::Prepare;
        protocol::JobPeer peer;
        std::uint64_t job = 0;
        std::uint32_t attempt = 0;
        std::size_t shard = 0;  // Bake
        bool audit = false;     // Bake
        Duration lease{};       // Prepare, Bake
        wire::BlobRef result;   // Fetch
    };

    ShardCoordinator(CoordinatorOptions options, std::size_t servers, TimePoint now);

    // The class that this bake's file will state: that of the first server in the list that got ready in time.
    const std::string& bakeClass() const { return _options.bakeClass; }
    // Whether a shard is audited.
    bool isAudited(std::size_t shard) const;
    // Gives shards out from now on. done: those that are; with their hashes (hashOfBlob of the file's bytes) where
    // known.
    struct Known {
        bool done = false;
        std::optional<Hash128> hash;
    };
    void start(const std::vector<Known>& shards, TimePoint now);
    bool isStarted() const { return _started; }

    // What is heard of servers (protocol::JobNews).
    void sessionBegun(protocol::JobPeer peer, const std::string& name, TimePoint now);
    void sessionEnded(protocol::JobPeer peer, const std::string& reason, TimePoint now);
    void leased(protocol::JobPeer peer, const wire::JobLease& lease, TimePoint now);
    void jobDone(protocol::JobPeer peer, const wire::JobDone& done, TimePoint now);
    // What a fetched result is; none when nobody needs it any more. The answer is ready() or refused() for a server's
    // readiness (kPrepareJob); spoilt() for a file that is not the shard, else stored(), or dissented() for a shard
    // that is done already: what is the same is not fetched.
    std::optional<std::uint64_t> fetched(protocol::JobPeer peer, const Hash128& result);
    void ready(protocol::JobPeer peer, const std::string& bakeClass, std::uint32_t slots, TimePoint now);
    void refused(protocol::JobPeer peer, const std::string& reason);
    void stored(protocol::JobPeer peer, std::size_t shard, TimePoint now);
    void dissented(protocol::JobPeer peer, std::size_t shard);
    void spoilt(protocol::JobPeer peer, std::size_t shard, const std::string& reason);

    // Takes back whatever is given out: nobody waits for it any more.
    void cancelAll();

    void advance(TimePoint now);
    TimePoint deadline() const;
    std::optional<Order> nextOrder();
    // For people, each once.
    std::vector<std::string> takeNotices() { return std::exchange(_notices, {}); }

    // Everything is baked and audited, or cannot be: see error().
    bool isFinished() const { return _finished || _error; }
    const std::optional<Error>& error() const { return _error; }
    // Of two servers that disagree about it: neither is to be believed.
    std::optional<std::size_t> disputedShard() const { return _disputed; }
    // Of one shard, 0 to 1.
    float progressOf(std::size_t shard) const;
    bool isDone(std::size_t shard) const { return _shards[shard].done; }
    std::uint32_t redone() const { return _redone; }                   // times that a shard was given out again
    std::uint32_t audited() const { return _audited; }                 // shards that two servers agree on
    std::size_t participants() const { return _participants.size(); }  // servers that were ready to bake
    std::size_t inFlight() const { return _attempts.size(); }

 private:
    struct Server {
        enum class State { Away, Preparing, Ready, Refused };
        State state = State::Away;
        std::uint32_t session = 0;
        std::string name;
        std::string why;  // Refused, or benched
        std::string bakeClass;
        std::uint32_t slots = 1;
        std::uint32_t prepareAttempt = 0;
        std::optional<TimePoint> prepareDeadline;
        std::optional<Hash128> readiness;  // being fetched
        TimePoint lastSign;
        int strikes = 0;
        bool benched = false;
        bool usable() const { return state == State::Ready && !benched; }
    };
    struct Shard {
        bool done = false;
        bool quarantined = false;
        std::optional<Hash128> hash;
        std::optional<std::size_t> by;
        std::uint32_t attempts = 0;
        int failures = 0;
        int losses = 0;
        std::set<std::size_t> failedOn;  // or never came back from
        bool auditWanted = false;
    };
    struct Attempt {
        std::size_t shard = 0;
        std::uint32_t number = 0;
        std::size_t server = 0;
        bool audit = false;
        bool leased = false;
        float progress = 0.0f;
        TimePoint since;
        TimePoint deadline;
        wire::BlobRef result;  // bytes > 0: waits to be fetched
        bool fetching = false;
    };
    using Attempts = std::vector<Attempt>;

    bool isCurrent(protocol::JobPeer peer) const;
    protocol::JobPeer peerOf(std::size_t server) const { return {server, _servers[server].session}; }
    std::string nameOf(std::size_t server) const;
    std::size_t outstanding(std::size_t server) const;
    std::size_t attemptsOf(std::size_t shard) const;
    std::size_t windowOf(const Server& server) const { return server.slots + 2; }
    Attempts::iterator find(std::size_t shard, std::uint32_t number);
    Attempts::iterator fetching(protocol::JobPeer peer, std::size_t shard);
    bool isUsableClass(std::size_t server);
    void decideClass(TimePoint now);
    void giveOut(TimePoint now);
    bool hasUsableBeside(const std::set<std::size_t>& servers) const;
    bool giveTo(std::size_t server, TimePoint now);
    void bake(std::size_t server, std::size_t shard, bool audit, TimePoint now);
    bool takeOver(std::size_t server, TimePoint now);
    void fetchNext();
    void cancel(const Attempt& attempt);
    // The attempt is gone, the shard open again unless others work on it.
    void giveBack(Attempts::iterator attempt, bool counts);
    void shardFailed(std::size_t shard, std::size_t server, const std::string& reason);
    void strike(std::size_t server, const std::string& reason);
    void resultOf(protocol::JobPeer peer, std::size_t shard, const wire::JobDone& done, TimePoint now);
    void settle(TimePoint now);
    void checkServers(TimePoint now);
    void remind(TimePoint now);
    void fail(std::string message);

    CoordinatorOptions _options;
    std::vector<Server> _servers;
    std::vector<Shard> _shards;
    std::set<std::size_t> _open;  // neither done, quarantined nor being attempted
    Attempts _attempts;
    std::deque<Order> _orders;
    std::vector<std::string> _notices;
    std::vector<Duration> _durations;  // of the last shards, from lease to end
    std::size_t _durationCount = 0;
    std::set<std::size_t> _participants;
    std::optional<TimePoint> _firstReady;
    TimePoint _lastUsable;
    TimePoint _lastProgress;  // or reminder
    TimePoint _now;
    bool _started = false;
    bool _finished = false;
    std::optional<Error> _error;
    std::optional<std::size_t> _disputed;
    std::string _lastQuarantine;
    std::uint32_t _redone = 0;
    std::uint32_t _audited = 0;
};

}  // namespace umbriel
