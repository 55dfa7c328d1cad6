#include "common/scene/element_kind.h"

#include <array>

#include "common/base/assert.h"

namespace umbriel {

const ElementKindInfo& infoOf(ElementKind kind) {
    static_assert(sizeof(bool) == 1 && sizeof(glm::vec3) == 12 && sizeof(glm::dvec3) == 24 && sizeof(glm::mat3) == 36 &&
                      sizeof(glm::mat4) == 64 && sizeof(glm::dmat4) == 128 && sizeof(ContainerId) == 8,
                  "field values are packed in memory as they travel");
    static constexpr std::array<ElementKindInfo, kElementKindCount> kInfos = {{
        {"bool", 1},
        {"u8", 1},
        {"u16", 2},
        {"u32", 4},
        {"i32", 4},
        {"u64", 8},
        {"f32", 4},
        {"f64", 8},
        {"vec2", 8},
        {"vec3", 12},
        {"vec4", 16},
        {"dvec3", 24},
        {"mat3", 36},
        {"mat4", 64},
        {"dmat4", 128},
        {"id", 8},
        {"string", 0},
    }};
    const auto index = static_cast<std::size_t>(kind);
    UMBRIEL_ASSERT(index < kInfos.size(), "unknown element kind");
    return kInfos[index];
}

}  // namespace umbriel
