#include "client/session/field_text.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <vector>

#include "common/scene/type_descriptor.h"

namespace umbriel {
namespace {

template <class T>
bool append(std::string_view text, std::vector<std::byte>& bytes) {
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) return false;
    if constexpr (std::is_floating_point_v<T>)
        if (!std::isfinite(value)) return false;
    const auto* raw = reinterpret_cast<const std::byte*>(&value);
    bytes.insert(bytes.end(), raw, raw + sizeof(value));
    return true;
}

template <class T>
bool appendList(std::string_view text, std::size_t count, std::vector<std::byte>& bytes) {
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t comma = text.find(',');
        if ((comma == std::string_view::npos) != (i + 1 == count)) return false;
        if (!append<T>(text.substr(0, comma), bytes)) return false;
        if (comma != std::string_view::npos) text.remove_prefix(comma + 1);
    }
    return true;
}

// What a value of this kind looks like; empty for kinds without a text.
std::string_view formOf(const FieldDescriptor& field) {
    if (field.isMulti) return {};
    switch (field.kind) {
        case ElementKind::Bool:
            return "true or false";
        case ElementKind::U8:
        case ElementKind::U16:
        case ElementKind::U32:
        case ElementKind::U64:
            return "a whole number of 0 or more";
        case ElementKind::I32:
            return "a whole number";
        case ElementKind::F32:
        case ElementKind::F64:
            return "a finite number";
        case ElementKind::Vec2:
            return "two numbers x,y";
        case ElementKind::Vec3:
        case ElementKind::DVec3:
            return "three numbers x,y,z";
        case ElementKind::Vec4:
            return "four numbers x,y,z,w";
        default:
            return {};
    }
}

bool parse(ElementKind kind, std::string_view text, std::vector<std::byte>& bytes) {
    switch (kind) {
        case ElementKind::Bool:
            if (text != "true" && text != "false" && text != "1" && text != "0") return false;
            bytes.push_back(static_cast<std::byte>(text == "true" || text == "1" ? 1 : 0));
            return true;
        case ElementKind::U8:
            return append<std::uint8_t>(text, bytes);
        case ElementKind::U16:
            return append<std::uint16_t>(text, bytes);
        case ElementKind::U32:
            return append<std::uint32_t>(text, bytes);
        case ElementKind::U64:
            return append<std::uint64_t>(text, bytes);
        case ElementKind::I32:
            return append<std::int32_t>(text, bytes);
        case ElementKind::F32:
            return append<float>(text, bytes);
        case ElementKind::F64:
            return append<double>(text, bytes);
        case ElementKind::Vec2:
            return appendList<float>(text, 2, bytes);
        case ElementKind::Vec3:
            return appendList<float>(text, 3, bytes);
        case ElementKind::Vec4:
            return appendList<float>(text, 4, bytes);
        case ElementKind::DVec3:
            return appendList<double>(text, 3, bytes);
        default:
            return false;
    }
}

template <class T>
std::string textOf(const void* address, std::size_t count) {
    const T* values = static_cast<const T*>(address);
    std::string text;
    for (std::size_t i = 0; i < count; ++i) text += fmt::format("{}{}", i > 0 ? "," : "", values[i]);
    return text;
}

}  // namespace

std::optional<std::string> fieldText(const Aspect& aspect, ContainerId id, std::string_view name) {
    const Container* container = aspect.find(id);
    if (!container) return std::nullopt;
    for (const FieldDescriptor& field : container->type().fields) {
        if (field.name != name || formOf(field).empty()) continue;
        const void* address = field.address_(*container);
        switch (field.kind) {
            case ElementKind::Bool:
                return *static_cast<const bool*>(address) ? "true" : "false";
            case ElementKind::U8:
                return std::to_string(*static_cast<const std::uint8_t*>(address));
            case ElementKind::U16:
                return textOf<std::uint16_t>(address, 1);
            case ElementKind::U32:
                return textOf<std::uint32_t>(address, 1);
            case ElementKind::U64:
                return textOf<std::uint64_t>(address, 1);
            case ElementKind::I32:
                return textOf<std::int32_t>(address, 1);
            case ElementKind::F32:
                return textOf<float>(address, 1);
            case ElementKind::F64:
                return textOf<double>(address, 1);
            case ElementKind::Vec2:
                return textOf<float>(address, 2);
            case ElementKind::Vec3:
                return textOf<float>(address, 3);
            case ElementKind::Vec4:
                return textOf<float>(address, 4);
            case ElementKind::DVec3:
                return textOf<double>(address, 3);
            default:
                return std::nullopt;
        }
    }
    return std::nullopt;
}

bool hasField(const Aspect& aspect, ContainerId id, std::string_view name) {
    const Container* container = aspect.find(id);
    if (!container) return false;
    for (const FieldDescriptor& field : container->type().fields)
        if (field.name == name && !field.isMulti) return true;
    return false;
}

Result<void> setField(Aspect& aspect, ContainerId id, std::string_view name, std::string_view value) {
    const Container* container = aspect.find(id);
    UMBRIEL_ASSERT(container, "a field of a container that exists");
    const TypeDescriptor& type = container->type();
    std::string known;
    for (std::uint32_t i = 0; i < type.fields.size(); ++i) {
        const FieldDescriptor& field = type.fields[i];
        const std::string_view form = formOf(field);
        if (form.empty()) continue;
        known += (known.empty() ? "" : ", ") + std::string(field.name);
        if (field.name != name) continue;
        std::vector<std::byte> bytes;
        if (!parse(field.kind, value, bytes))
            return badInput(fmt::format("{} '{}': '{}' does not fit, expected {}", type.name, name, value, form));
        if (field.enumCount > 0) {
            std::uint32_t number = 0;
            std::memcpy(&number, bytes.data(), sizeof(number));
            if (number >= field.enumCount)
                return badInput(
                    fmt::format("{} '{}': {} is none of its {} values", type.name, name, number, field.enumCount));
        }
        RawEdit(aspect).setSingle(id, i, bytes);
        return {};
    }
    return badInput(fmt::format("{} has no field '{}' that can be set; it has {}", type.name, name, known));
}

}  // namespace umbriel
