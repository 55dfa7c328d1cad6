#pragma once

#include <glm/glm.hpp>

// The shared formulas (formula/*.glsl) as C++, once in float and once in double. shaders/README.md describes the subset
// of GLSL that makes this possible. The functions are documented in the .glsl files.

// Only for the lines below; undefined again at the end.
#define REAL(x) Real(x)
#define FORMULA_FN inline
#define FORMULA_CONST inline constexpr
#define OUT(T) T&

// What the formulas may call: GLSL's built-ins, from GLM.
#define UMBRIEL_FORMULA_BUILT_INS \
    using glm::abs;               \
    using glm::clamp;             \
    using glm::cos;               \
    using glm::cross;             \
    using glm::dot;               \
    using glm::exp;               \
    using glm::log;               \
    using glm::max;               \
    using glm::min;               \
    using glm::mix;               \
    using glm::sin;               \
    using glm::sqrt;

// As the render servers compute.
namespace umbriel::formula_f32 {
using Real = float;
using Vec2 = glm::vec2;
using Vec3 = glm::vec3;
UMBRIEL_FORMULA_BUILT_INS
#include "shaders/formula_list.inc"
}  // namespace umbriel::formula_f32

// The reference that float is measured against.
namespace umbriel::formula_f64 {
using Real = double;
using Vec2 = glm::dvec2;
using Vec3 = glm::dvec3;
UMBRIEL_FORMULA_BUILT_INS
#include "shaders/formula_list.inc"
}  // namespace umbriel::formula_f64

#undef REAL
#undef FORMULA_FN
#undef FORMULA_CONST
#undef OUT
#undef UMBRIEL_FORMULA_BUILT_INS
