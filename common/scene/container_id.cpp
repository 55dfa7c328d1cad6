#include "common/scene/container_id.h"

#include <limits>

namespace umbriel {

void IdSource::skipPast(ContainerId id) {
    if (id.value == std::numeric_limits<std::uint64_t>::max()) return;  // no id follows the last one
    std::uint64_t next = _next.load(std::memory_order_relaxed);
    while (next <= id.value && !_next.compare_exchange_weak(next, id.value + 1, std::memory_order_relaxed)) {
    }
}

}  // namespace umbriel
