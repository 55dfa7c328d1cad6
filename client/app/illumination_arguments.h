#pragma once

#include <optional>
#include <string_view>

#include "common/base/result.h"
#include "common/scene/materials.h"
#include "common/scene/nodes.h"
#include "common/scene/windows.h"

namespace umbriel {

// "phong", "blinn-phong", ...: docs/commands.md lists them.
Result<ReflectionModel> parseReflectionModel(std::string_view text);
std::string_view nameOf(ReflectionModel model);

// "flat", "flat-mean", "gouraud", "phong".
Result<ShadingFrequency> parseShading(std::string_view text);
std::string_view nameOf(ShadingFrequency frequency);

// One --fog.
struct FogArgument {
    FogMode mode = FogMode::Linear;
    float start = 0.0f;  // metres
    float end = 0.0f;
    float density = 0.0f;             // 1/m
    std::optional<glm::vec3> colour;  // radiance; none: the background's
};
// "linear:START:END", "quadratic:START:END", "exp:DENSITY", "exp2:DENSITY", each with an optional "@r,g,b".
Result<FogArgument> parseFog(std::string_view text);

}  // namespace umbriel
