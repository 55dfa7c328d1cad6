#include "server/bake/process_meter.h"

#include <utility>

#include "common/base/assert.h"
#include "common/base/processor_time.h"

namespace umbriel {

ProcessMeter::Span::Span(ProcessMeter& meter) : _meter(&meter) {
    const std::lock_guard lock(meter._mutex);
    if (meter._running++ == 0) meter._counted = processorTime();
}

ProcessMeter::Span::~Span() {
    if (_meter) end();
}

Duration ProcessMeter::Span::end() {
    UMBRIEL_ASSERT(_meter, "a span ends once");
    ProcessMeter& meter = *std::exchange(_meter, nullptr);
    const std::lock_guard lock(meter._mutex);
    --meter._running;
    const Duration now = processorTime();
    return now - std::exchange(meter._counted, now);
}

}  // namespace umbriel
