#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

#include "common/math/glm.h"
#include "common/scene/container_id.h"

namespace umbriel {

// What a field is made of. Fixed-size kinds are stored in memory exactly as they travel: little-endian, packed.
enum class ElementKind : std::uint8_t {
    Bool, U8, U16, U32, I32, U64, F32, F64, Vec2, Vec3, Vec4, DVec3, Mat3, Mat4, DMat4, Id, String
};
inline constexpr std::uint32_t kElementKindCount = static_cast<std::uint32_t>(ElementKind::String) + 1;

// What is the same for all fields whose elements are of a kind.
struct ElementKindInfo {
    std::string_view name;
    std::uint32_t size;  // bytes per element in memory and on the wire; 0 for String
};
const ElementKindInfo& infoOf(ElementKind kind);

// Enums may be field values when their underlying type is std::uint32_t and they specialise this with the number of
// their values: a decoder refuses anything else.
template <class E>
inline constexpr std::uint32_t kEnumCount = 0;

// Maps a C++ type to its kind; types without a mapping cannot be fields.
template <class T>
constexpr ElementKind elementKindOf() {
    if constexpr (std::is_enum_v<T>) {
        static_assert(std::is_same_v<std::underlying_type_t<T>, std::uint32_t>, "field enums are uint32_t");
        static_assert(kEnumCount<T> > 0, "specialise kEnumCount for this enum");
        return ElementKind::U32;
    } else if constexpr (std::is_same_v<T, bool>) return ElementKind::Bool;
    else if constexpr (std::is_same_v<T, std::uint8_t>) return ElementKind::U8;
    else if constexpr (std::is_same_v<T, std::uint16_t>) return ElementKind::U16;
    else if constexpr (std::is_same_v<T, std::uint32_t>) return ElementKind::U32;
    else if constexpr (std::is_same_v<T, std::int32_t>) return ElementKind::I32;
    else if constexpr (std::is_same_v<T, std::uint64_t>) return ElementKind::U64;
    else if constexpr (std::is_same_v<T, float>) return ElementKind::F32;
    else if constexpr (std::is_same_v<T, double>) return ElementKind::F64;
    else if constexpr (std::is_same_v<T, glm::vec2>) return ElementKind::Vec2;
    else if constexpr (std::is_same_v<T, glm::vec3>) return ElementKind::Vec3;
    else if constexpr (std::is_same_v<T, glm::vec4>) return ElementKind::Vec4;
    else if constexpr (std::is_same_v<T, glm::dvec3>) return ElementKind::DVec3;
    else if constexpr (std::is_same_v<T, glm::mat3>) return ElementKind::Mat3;
    else if constexpr (std::is_same_v<T, glm::mat4>) return ElementKind::Mat4;
    else if constexpr (std::is_same_v<T, glm::dmat4>) return ElementKind::DMat4;
    else if constexpr (std::is_same_v<T, std::string>) return ElementKind::String;
    else if constexpr (std::is_same_v<T, ContainerId>) return ElementKind::Id;
    else {
        static_assert(requires(T t) { t.id; }, "this type cannot be a field");
        return ElementKind::Id;
    }
}

}  // namespace umbriel
