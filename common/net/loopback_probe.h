#pragma once

#include <string>

#include "common/base/result.h"

namespace umbriel::net {

// Whether this machine can talk to itself: listens on an ephemeral loopback port, connects to it, sends a byte each way.
// On success a line for `umbriel doctor`.
Result<std::string> probeLoopback();

}  // namespace umbriel::net
