#pragma once

#include <mutex>

#include "common/base/clock.h"

namespace umbriel {

// What work costs that is done by threads which nobody can name, such as a software renderer's: the processor time of
// the whole process while there is such work. Whatever runs beside it is in the figure. Where several pieces of work
// overlap, each moment counts for the one that ends first after it, so that their sum is what the process took. From
// any thread.
class ProcessMeter {
 public:
    // One piece of work, from its construction on.
    class Span {
     public:
        explicit Span(ProcessMeter& meter);
        ~Span();
        Span(const Span&) = delete;
        Span& operator=(const Span&) = delete;
        // Ends it: what it cost. Once.
        Duration end();

     private:
        ProcessMeter* _meter;  // null: it is over
    };

 private:
    std::mutex _mutex;
    int _running = 0;
    Duration _counted{};  // time of the process up to which all is accounted for
};

}  // namespace umbriel
