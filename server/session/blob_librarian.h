#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <variant>
#include <vector>

#include "server/session/blob_folder.h"

namespace umbriel {

// Loads and stores blobs on a thread of its own, so that no heartbeat waits for a disk. Stores wait until nothing has
// happened for a while: writing takes from the processor what a joining server needs. Of those that wait there is a
// limit in bytes, beyond which blobs are not kept: they share their chunks with the scene, which may have let go of
// them.
class BlobLibrarian {
 public:
    static constexpr std::uint64_t kMostWaiting = std::uint64_t{256} << 20;
    static constexpr auto kStoreAfter = std::chrono::milliseconds(500);

    struct Loaded {
        std::uint64_t request = 0;
        std::vector<wire::Blob> blobs;      // that were there
        std::vector<wire::BlobRef> others;  // that were not
    };

    // answer: called on its thread; several times for one load, as soon as something is known, with each blob once.
    BlobLibrarian(BlobFolder folder, std::function<void(Loaded)> answer);
    // What is to be stored is stored first.
    ~BlobLibrarian();

    void load(std::uint64_t request, std::vector<wire::BlobRef> refs);
    void store(wire::Blob blob);

 private:
    struct Load {
        std::uint64_t request = 0;
        std::vector<wire::BlobRef> refs;
    };
    void run();
    void answer(const Load& load);

    BlobFolder _folder;  // on the thread
    std::function<void(Loaded)> _answer;
    std::mutex _mutex;
    std::condition_variable _filled;
    std::deque<Load> _loads;
    std::deque<wire::Blob> _stores;
    std::uint64_t _waiting = 0;  // bytes
    bool _ending = false;
    std::thread _thread;
};

}  // namespace umbriel
