#pragma once

#include <string>

#include "common/protocol/digest_comparison.h"
#include "common/scene/aspect.h"

namespace umbriel {

// What follows "the state of ... differs": container and field in words, or that none is to be found. scene: to name
// what is in it; may be null.
std::string stateDifferenceText(const protocol::DigestDifference& difference, const Aspect* scene);

}  // namespace umbriel
