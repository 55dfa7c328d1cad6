#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/bake/cluster_bake.h"
#include "common/net/memory_pump.h"
#include "common/protocol/cluster_client.h"
#include "common/visibility/bake.h"
#include "tests/sim/random.h"

namespace umbriel::sim {

// What all bakes here are about, baked once.
struct BakeSubject {
    visibility::Mesh loaded;
    visibility::BakeMesh mesh;
    visibility::BakeSettings settings;
    std::unique_ptr<visibility::Baker> baker;
    std::vector<visibility::Bytes> shards;  // of one block each
    std::string whole;                      // the file

    BakeSubject();
};
const BakeSubject& bakeSubject();

// How a server does its work.
enum class Manner { Honest, OtherClass, Garbage, Liar, Failing, Stalling };

class BakeServer;

// Servers, network and faults on a virtual clock. The client is made anew for each call of bake().
class BakeWorld {
 public:
    BakeWorld(std::uint64_t seed, std::vector<Manner> manners);
    ~BakeWorld();
    BakeWorld(const BakeWorld&) = delete;
    BakeWorld& operator=(const BakeWorld&) = delete;

    bool faults = false;
    std::optional<Duration> clientDiesAfter;
    int killed = 0;
    int paused = 0;
    std::size_t mostInFlight = 0;

    TimePoint now() const { return _network.now(); }
    Result<ClusterBakeOutcome> bake(const ClusterBakeOptions& options) { return bakeInTurn({options}).front(); }
    // One client and its sessions; each is given up after `lives` of them, where that is not empty.
    std::vector<Result<ClusterBakeOutcome>> bakeInTurn(const std::vector<ClusterBakeOptions>& bakes,
                                                       const std::vector<Duration>& lives = {});

 private:
    struct Host {
        std::vector<std::unique_ptr<BakeServer>> programs;  // old ones stay: the network knows them by address
        bool runs = false;
        std::optional<TimePoint> mend;
        bool isPaused = false;
    };
    class Port;

    void start(std::size_t host);
    void step();
    void fault(std::size_t number);

    Random _random;
    net::MemoryNetwork _network;
    std::vector<Manner> _manners;
    std::vector<Host> _hosts;
    std::vector<std::unique_ptr<protocol::ClusterClient>> _clients;
};

}  // namespace umbriel::sim
