#pragma once

#include <string>

#include "common/scene/aspect.h"

namespace umbriel {

// One container as text, from its declaration: "Transform #12 "wheel" {linear: (...), translation: (0, 1, 2)}". Fields
// at their default are left out unless all is set; of long multi fields the size and the first elements are shown.
std::string describe(const Container& container, bool all = false);
// One field's value as text.
std::string describeField(const Container& container, std::uint32_t field);
// The names of two containers' differing fields, for messages; empty when equal; "type (Node and Image)" when the types
// differ.
std::string describeDifference(const Container& a, const Container& b);

}  // namespace umbriel
