#include "common/scene/print.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/scene/field_values.h"

namespace umbriel {

namespace {

constexpr std::size_t kShownElements = 4;

// Text from files may hold anything; what is printed stays on one line.
std::string quoted(std::string_view text) {
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\')
            out += {'\\', c};
        else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
            out += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
        else
            out += c;
    }
    return out + '"';
}

template <class T>
T load(std::span<const std::byte> bytes) {
    T value;
    std::memcpy(&value, bytes.data(), sizeof(T));
    return value;
}

template <class T>
std::string tuple(std::span<const std::byte> bytes) {
    std::string out = "(";
    for (std::size_t at = 0; at < bytes.size(); at += sizeof(T))
        out += fmt::format("{}{}", at == 0 ? "" : ", ", load<T>(bytes.subspan(at)));
    return out + ")";
}

// Column by column, as they lie in memory.
template <class T>
std::string matrix(std::span<const std::byte> bytes, std::size_t rows) {
    std::string out = "(";
    for (std::size_t at = 0; at < bytes.size(); at += rows * sizeof(T))
        out += (at == 0 ? "" : ", ") + tuple<T>(bytes.subspan(at, rows * sizeof(T)));
    return out + ")";
}

std::string elementText(ElementKind kind, std::span<const std::byte> bytes) {
    switch (kind) {
        case ElementKind::Bool:
            return load<std::uint8_t>(bytes) ? "true" : "false";
        case ElementKind::U8:
            return fmt::to_string(static_cast<unsigned>(load<std::uint8_t>(bytes)));
        case ElementKind::U16:
            return fmt::to_string(load<std::uint16_t>(bytes));
        case ElementKind::U32:
            return fmt::to_string(load<std::uint32_t>(bytes));
        case ElementKind::I32:
            return fmt::to_string(load<std::int32_t>(bytes));
        case ElementKind::U64:
            return fmt::to_string(load<std::uint64_t>(bytes));
        case ElementKind::F32:
            return fmt::format("{}", load<float>(bytes));
        case ElementKind::F64:
            return fmt::format("{}", load<double>(bytes));
        case ElementKind::Vec2:
        case ElementKind::Vec3:
        case ElementKind::Vec4:
            return tuple<float>(bytes);
        case ElementKind::DVec3:
            return tuple<double>(bytes);
        case ElementKind::Mat3:
            return matrix<float>(bytes, 3);
        case ElementKind::Mat4:
            return matrix<float>(bytes, 4);
        case ElementKind::DMat4:
            return matrix<double>(bytes, 4);
        case ElementKind::Id:
            return fmt::format("#{}", load<std::uint64_t>(bytes));
        case ElementKind::String:
            break;
    }
    UMBRIEL_ASSERT(kind == ElementKind::String, "unknown element kind");
    return quoted({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace

std::string describeField(const Container& container, std::uint32_t index) {
    const auto& fields = container.type().fields;
    UMBRIEL_ASSERT(index < fields.size(), "no such field");
    const FieldDescriptor& field = fields[index];
    if (!field.isMulti) return elementText(field.kind, bytesOfSingle(field, container));
    const MultiStorage& storage = field.multi(container);
    std::string out = fmt::format("{} [", storage.size());
    for (std::size_t i = 0; i < std::min(storage.size(), kShownElements); ++i)
        out += (i == 0 ? "" : ", ") + elementText(field.kind, {storage.element(i), storage.elementSize()});
    return out + (storage.size() > kShownElements ? ", ...]" : "]");
}

std::string describe(const Container& container, bool all) {
    const TypeDescriptor& type = container.type();
    std::string out = fmt::format("{} #{}", type.name, container.id().value);
    if (!container.name.get().empty()) out += " " + quoted(container.name.get());
    out += " {";
    bool first = true;
    for (std::uint32_t i = 1; i < type.fields.size(); ++i) {  // field 0 is the name
        if (!all && fieldEquals(type.fields[i], container, *type.prototype)) continue;
        out += fmt::format("{}{}: {}", first ? "" : ", ", type.fields[i].name, describeField(container, i));
        first = false;
    }
    return out + "}";
}

std::string describeDifference(const Container& a, const Container& b) {
    if (a.type().name != b.type().name) return fmt::format("type ({} and {})", a.type().name, b.type().name);
    std::string out;
    for (const FieldDescriptor& field : a.type().fields)
        if (!fieldEquals(field, a, b)) out += fmt::format("{}{}", out.empty() ? "" : ", ", field.name);
    return out;
}

}  // namespace umbriel
