#include "client/app/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace umbriel {

Progress::Progress(std::string what, std::uint64_t total, bool quiet)
    : _what(std::move(what)), _total(total), _enabled(!quiet && ::isatty(STDERR_FILENO) == 1), _start(SteadyClock{}.now()),
      _lastShown(_start) {}

void Progress::at(std::uint64_t done) {
    _done = done;
    if (!_enabled || done == 0) return;
    const TimePoint now = SteadyClock{}.now();
    if (now - _start < std::chrono::seconds(1) || now - _lastShown < std::chrono::milliseconds(200)) return;
    _lastShown = now;
    _shown = true;
    const double remaining = toSeconds(now - _start) / static_cast<double>(_done) * static_cast<double>(_total - _done);
    fmt::print(stderr, "\r{} {}/{}, {:.0f} s left \x1b[K", _what, _done, _total, remaining);
    std::fflush(stderr);
}

void Progress::finish() {
    if (_shown) {
        fmt::print(stderr, "\r\x1b[K");
        std::fflush(stderr);
    }
    _shown = false;
    _enabled = false;
}

}  // namespace umbriel
