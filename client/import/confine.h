#pragma once

#include <string>

#include "client/import/import_limits.h"
#include "common/base/result.h"

namespace umbriel {

// Takes from this process what parsing a file does not need, for good: memory and processor time beyond the limits,
// open files above lastDescriptor, the network, other programs, and, where the kernel can (Landlock, Linux 5.13), every
// file outside the folder of the one to parse. An error when a limit of memory or time cannot be set.
Result<void> confineProcess(const ImportLimits& limits, const std::string& file, int lastDescriptor);

}  // namespace umbriel
