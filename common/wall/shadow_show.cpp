#include "common/wall/shadow_show.h"

#include <algorithm>

namespace umbriel {

PixelRect ShowLayout::cell(std::int32_t part) const {
    return {x + part % columns * side, y + (rows - 1 - part / columns) * side, side, side};
}

ShowLayout showLayoutOf(const PixelRect& region, std::int32_t parts) {
    ShowLayout best;
    for (std::int32_t columns = 1; columns <= parts; ++columns) {
        const std::int32_t rows = (parts + columns - 1) / columns;
        const std::int32_t side = std::min(region.width / columns, region.height / rows);
        if (side <= best.side) continue;
        best = {columns, rows, side, region.x + (region.width - columns * side) / 2,
                region.y + (region.height - rows * side) / 2};
    }
    return best;
}

std::optional<ContainerId> shownLight(const std::vector<ShadowFit>& fits, std::uint32_t showLight) {
    std::vector<ContainerId> lights;
    for (const ShadowFit& fit : fits) lights.push_back(fit.light);
    std::sort(lights.begin(), lights.end());
    lights.erase(std::unique(lights.begin(), lights.end()), lights.end());
    if (lights.empty()) return std::nullopt;
    return lights[std::min<std::size_t>(showLight, lights.size() - 1)];
}

bool isOverlay(ShadowShow show) {
    return show == ShadowShow::ShadowMap || show == ShadowShow::FactorMap || show == ShadowShow::EdgeMap ||
           show == ShadowShow::SeenArea;
}

}  // namespace umbriel
