#pragma once

#include <chrono>
#include <thread>

namespace umbriel::test {

// How long a test waits for what must happen: the one bound on waiting, longer than any load explains and shorter than
// the watchdog, so that what does not happen fails with words. Nothing that a test expects depends on it.
inline constexpr std::chrono::seconds kPatience{240};

// Asks until the condition holds, true, or kPatience has passed, false.
template <class Condition>
bool waitUntil(Condition&& condition) {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (!condition()) {
        if (std::chrono::steady_clock::now() >= end) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
}

}  // namespace umbriel::test
