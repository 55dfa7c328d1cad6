#pragma once

#include <span>
#include <string_view>

#include "common/base/result.h"
#include "common/scene/animation.h"
#include "common/scene/aspect.h"

namespace umbriel {

// A scene that needs no file: `demo:NAME` or `demo:NAME?option=value&option=value`.
struct DemoDescription {
    std::string_view name;
    std::string_view summary;  // for --help
    std::string_view options;  // "n=BUILDINGS (1 to 100000, default 2000)"; empty: none
};
std::span<const DemoDescription> demos();

// True when the text names a procedural scene (it begins with "demo:").
bool isDemo(std::string_view uri);

// Builds the scene into the aspect: metres, +y up, lit by a sun and a little ambient light, with a camera named "main".
// The same bits on every call and machine of one C library. An unknown demo or option is an error that lists the known
// ones.
Result<Ref<LoadedScene>> buildDemo(std::string_view uri, Aspect& aspect);

}  // namespace umbriel
