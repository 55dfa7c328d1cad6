#pragma once

namespace umbriel {

// Seconds of the processor that this process has taken, all threads together.
double processorSeconds();

}  // namespace umbriel
