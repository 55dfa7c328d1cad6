#pragma once

#include <cstddef>
#include <span>

#include "common/scene/type_descriptor.h"

namespace umbriel {

// The generic machinery's way to a single field's value.

// The value of a single field as bytes: what is hashed, compared and shipped. Of a String its characters.
std::span<const std::byte> bytesOfSingle(const FieldDescriptor& field, const Container& container);

// The same value, bit for bit. Both containers are of the type the field belongs to.
bool fieldEquals(const FieldDescriptor& field, const Container& a, const Container& b);

}  // namespace umbriel
