#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/wall/view.h"

namespace umbriel {

// Where the parts of a light's map are shown in a viewport: squares of equal size, row by row from the upper left, as
// large as they fit, in the middle.
struct ShowLayout {
    std::int32_t columns = 1;
    std::int32_t rows = 1;
    std::int32_t side = 0;  // pixels
    std::int32_t x = 0;     // of the lower left corner of all, on the wall
    std::int32_t y = 0;
    PixelRect cell(std::int32_t part) const;
};
ShowLayout showLayoutOf(const PixelRect& region, std::int32_t parts);

// The light whose shadow is shown: showLight-th of those with a fit, ascending by id, the last one beyond. None
// without.
std::optional<ContainerId> shownLight(const std::vector<ShadowFit>& fits, std::uint32_t showLight);

// Whether the view is filled with something else than the scene.
bool isOverlay(ShadowShow show);

}  // namespace umbriel
