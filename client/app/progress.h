#pragma once

#include <cstdint>
#include <string>

#include "common/base/clock.h"

namespace umbriel {

// One line on stderr that says how far long work is and when it will be done; only on a terminal, only after a second.
class Progress {
   public:
    Progress(std::string what, std::uint64_t total, bool quiet);
    ~Progress() { finish(); }
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void step() { at(_done + 1); }
    // So much is done in all.
    void at(std::uint64_t done);
    // Clears the line.
    void finish();

   private:
    std::string _what;
    std::uint64_t _total;
    std::uint64_t _done = 0;
    bool _enabled;
    bool _shown = false;
    TimePoint _start;
    TimePoint _lastShown;
};

}  // namespace umbriel
