#pragma once

#include <cstddef>
#include <cstdint>

#include <glm/glm.hpp>

// The structs that C++ fills and GLSL reads (structs/*.glsl), with their layout asserted. shaders/README.md says which
// members are allowed.

#define LAYOUT_SIZE(Type, bytes) static_assert(sizeof(Type) == (bytes) && (bytes) % 16 == 0);
#define LAYOUT_OFFSET(Type, member, bytes) static_assert(offsetof(Type, member) == (bytes));

namespace umbriel::gpu {
using uint = std::uint32_t;
using glm::ivec4;
using glm::mat4;
using glm::uvec4;
using glm::vec2;
using glm::vec3;
using glm::vec4;
#include "shaders/structs/deformation.glsl"
#include "shaders/structs/light.glsl"
#include "shaders/structs/blob.glsl"
#include "shaders/structs/raster_eye.glsl"
#include "shaders/structs/shadow.glsl"
#include "shaders/structs/light_block.glsl"
}  // namespace umbriel::gpu

#undef LAYOUT_SIZE
#undef LAYOUT_OFFSET
