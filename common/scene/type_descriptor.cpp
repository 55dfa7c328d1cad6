#include "common/scene/type_descriptor.h"

#include "common/base/assert.h"
#include "common/base/hash.h"

namespace umbriel {

namespace {

// Fixed width and length prefixes: no two registries describe themselves with the same bytes.
void append(std::string& out, std::uint64_t value) {
    for (int i = 0; i < 8; ++i) out.push_back(static_cast<char>(value >> (8 * i)));
}

void append(std::string& out, std::string_view text) {
    append(out, text.size());
    out.append(text);
}

}  // namespace

const TypeDescriptor* TypeRegistry::at(std::uint32_t index) const {
    return index < _types.size() ? _types[index].get() : nullptr;
}

const TypeDescriptor* TypeRegistry::byName(std::string_view name) const {
    for (const auto& type : _types)
        if (type->name == name) return type.get();
    return nullptr;
}

std::uint64_t TypeRegistry::signature() const {
    std::string text;
    append(text, _types.size());
    for (const auto& type : _types) {
        append(text, type->name);
        append(text, type->shipped ? 1 : 0);
        append(text, type->fields.size());
        for (const FieldDescriptor& field : type->fields) {
            append(text, field.name);
            append(text, static_cast<std::uint64_t>(field.kind));
            append(text, field.isMulti ? 1 : 0);
            append(text, field.enumCount);
        }
    }
    return hash64(std::as_bytes(std::span(text)));
}

const TypeDescriptor& TypeRegistry::add(std::unique_ptr<TypeDescriptor> descriptor) {
    UMBRIEL_ASSERT(byName(descriptor->name) == nullptr, "two types of one name");
    UMBRIEL_ASSERT(descriptor->fields.size() <= kMaxFields, "too many fields for a mask");
    for (std::size_t i = 0; i < descriptor->fields.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            UMBRIEL_ASSERT(descriptor->fields[i].name != descriptor->fields[j].name, "two fields of one name");
    descriptor->index = static_cast<std::uint32_t>(_types.size());
    descriptor->prototype = descriptor->create();
    descriptor->prototype->_type = descriptor.get();
    _types.push_back(std::move(descriptor));
    return *_types.back();
}

const TypeDescriptor& TypeRegistry::byTag(const void* tag) const {
    for (const auto& type : _types)
        if (type->cppType == tag) return *type;
    UMBRIEL_ASSERT(false, "this type was not added to the registry");
    return *_types.front();
}

}  // namespace umbriel
