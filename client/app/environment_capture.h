#pragma once

#include <cstdint>

#include "client/app/arguments.h"
#include "client/app/stage.h"
#include "client/session/cluster.h"

namespace umbriel {

// Texels a side of the views that an environment is captured with, and of the map that is made of them.
inline constexpr int kCaptureSide = 256;
inline constexpr int kCapturedFaceSize = 128;

// Has the servers draw the scene all around a point, six views of 90 degrees on a wall of their own, and makes that the
// map of the stage's environment light; then once more with the map in effect, as often as said. So an environment is
// what the same servers show, to the bit the same for all of them. Returns how many frames that took. The caller
// assigns its tiles again. Errors: the servers'.
Result<std::uint64_t> captureEnvironment(Cluster& cluster, Aspect& scene, const Stage& stage,
                                         const EnvironmentArgument& argument);

}  // namespace umbriel
