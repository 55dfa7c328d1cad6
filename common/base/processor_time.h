#pragma once

#include "common/base/clock.h"

namespace umbriel {

// Time of processors that this process has taken since it began, all of its threads together: a software renderer's
// with them.
Duration processorTime();
// The same of the calling thread alone.
Duration threadProcessorTime();

}  // namespace umbriel
