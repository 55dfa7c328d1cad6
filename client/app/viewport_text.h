#pragma once

#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/scene/windows.h"

namespace umbriel {

// What users write for the fields of a viewport: --shadow-set, the viewer's panel, techniques.

// union, scene or per-view.
Result<ShadowFitMode> parseShadowFit(std::string_view text);
std::string_view nameOf(ShadowFitMode fit);
// What setField() takes for `value`: names of modes, views and fits become their numbers, all else stays as it is. Bad
// input for a name that is none.
Result<std::string> viewportFieldText(std::string_view field, std::string_view value);

}  // namespace umbriel
