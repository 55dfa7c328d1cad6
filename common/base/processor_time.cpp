#include "common/base/processor_time.h"

#include <time.h>

namespace umbriel {
namespace {

Duration read(clockid_t clock) {
    timespec now{};
    ::clock_gettime(clock, &now);
    return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

}  // namespace

Duration processorTime() {
    return read(CLOCK_PROCESS_CPUTIME_ID);
}

Duration threadProcessorTime() {
    return read(CLOCK_THREAD_CPUTIME_ID);
}

}  // namespace umbriel
