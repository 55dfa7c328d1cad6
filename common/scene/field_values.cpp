#include "common/scene/field_values.h"

#include <algorithm>

namespace umbriel {

std::span<const std::byte> bytesOfSingle(const FieldDescriptor& field, const Container& container) {
    UMBRIEL_ASSERT(!field.isMulti, "a multi field has no single value");
    if (field.kind == ElementKind::String) return std::as_bytes(std::span(field.text(container)));
    return {static_cast<const std::byte*>(field.address_(container)), infoOf(field.kind).size};
}

bool fieldEquals(const FieldDescriptor& field, const Container& a, const Container& b) {
    if (field.isMulti) return field.multi(a).equals(field.multi(b));
    return std::ranges::equal(bytesOfSingle(field, a), bytesOfSingle(field, b));
}

}  // namespace umbriel
