#pragma once

#include <chrono>

namespace umbriel {

using Duration = std::chrono::nanoseconds;
using TimePoint = std::chrono::time_point<std::chrono::steady_clock, Duration>;

// The only source of time in protocol and session code, so that tests drive it by hand. Wall-clock time is never used:
// it jumps.
class Clock {
   public:
    virtual ~Clock() = default;
    virtual TimePoint now() const = 0;
};

// The machine's monotonic clock.
class SteadyClock final : public Clock {
   public:
    TimePoint now() const override { return std::chrono::steady_clock::now(); }
};

// Stands still until told otherwise.
class ManualClock final : public Clock {
   public:
    TimePoint now() const override { return _now; }
    void advance(Duration by) { _now += by; }

   private:
    TimePoint _now{};
};

inline double toSeconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }
inline double toMilliseconds(Duration duration) { return std::chrono::duration<double, std::milli>(duration).count(); }

}  // namespace umbriel
