#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/scene/aspect.h"

namespace umbriel {

// Sets a single field of a container from text, as an edit: true and false, numbers, "x,y,z", an enum by its number.
// Bad input, naming the container's type and what it has, for a field that is not there or cannot be written as text
// (references, lists), and for a value that does not fit.
Result<void> setField(Aspect& aspect, ContainerId container, std::string_view field, std::string_view value);

// The field's value as setField() reads it; nothing for a field that is not there or has no text.
std::optional<std::string> fieldText(const Aspect& aspect, ContainerId container, std::string_view field);

// Whether the container's type has a single field of this name.
bool hasField(const Aspect& aspect, ContainerId container, std::string_view field);

}  // namespace umbriel
