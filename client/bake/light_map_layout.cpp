#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "client/bake/light_map_charts.h"
#include "common/base/assert.h"

namespace umbriel {
namespace {

// The upper border of what was placed, from left to right. A rectangle goes where its top comes to lie lowest, of
// several such places to the left one (Jylänki 2010, "skyline bottom-left").
class Skyline {
 public:
    explicit Skyline(std::uint32_t size) : _size(size), _steps{{0, 0, size}} {}

    bool place(std::uint32_t width, std::uint32_t height, std::uint32_t& x, std::uint32_t& y) {
        std::uint32_t lowest = 0xffffffffu;
        std::size_t chosen = 0;
        for (std::size_t i = 0; i < _steps.size(); ++i) {
            if (_steps[i].x + width > _size) break;
            std::uint32_t bottom = 0;
            for (std::size_t k = i; k < _steps.size() && _steps[k].x < _steps[i].x + width; ++k)
                bottom = std::max(bottom, _steps[k].y);
            if (bottom + height > _size || bottom + height >= lowest) continue;
            lowest = bottom + height;
            chosen = i;
            y = bottom;
        }
        if (lowest == 0xffffffffu) return false;
        x = _steps[chosen].x;
        const std::uint32_t end = x + width;
        // The steps below it go, but for what of the last one reaches beyond.
        std::size_t last = chosen;
        while (last < _steps.size() && _steps[last].x + _steps[last].width <= end) ++last;
        if (last < _steps.size() && _steps[last].x < end) {
            _steps[last].width -= end - _steps[last].x;
            _steps[last].x = end;
        }
        _steps.erase(_steps.begin() + static_cast<std::ptrdiff_t>(chosen),
                     _steps.begin() + static_cast<std::ptrdiff_t>(last));
        _steps.insert(_steps.begin() + static_cast<std::ptrdiff_t>(chosen), {x, lowest, width});
        merge(chosen);
        return true;
    }

 private:
    struct Step {
        std::uint32_t x, y, width;
    };
    void merge(std::size_t at) {
        if (at + 1 < _steps.size() && _steps[at + 1].y == _steps[at].y) {
            _steps[at].width += _steps[at + 1].width;
            _steps.erase(_steps.begin() + static_cast<std::ptrdiff_t>(at) + 1);
        }
        if (at > 0 && _steps[at - 1].y == _steps[at].y) {
            _steps[at - 1].width += _steps[at].width;
            _steps.erase(_steps.begin() + static_cast<std::ptrdiff_t>(at));
        }
    }
    std::uint32_t _size;
    std::vector<Step> _steps;
};

// Texels of a side.
double texelsOf(double extent, double texelsPerMetre) {
    return std::max(1.0, std::floor(extent * texelsPerMetre + 0.5));
}

bool tryLayOut(const std::vector<glm::dvec2>& extents, std::uint32_t size, double texelsPerMetre,
               std::vector<ChartSpot>& spots) {
    spots.assign(extents.size(), {});
    for (std::size_t i = 0; i < extents.size(); ++i) {
        ChartSpot& spot = spots[i];
        const glm::dvec2 texels(texelsOf(extents[i].x, texelsPerMetre), texelsOf(extents[i].y, texelsPerMetre));
        if (texels.x > size || texels.y > size) return false;
        spot.width = static_cast<std::uint32_t>(texels.x);
        spot.height = static_cast<std::uint32_t>(texels.y);
        for (int k = 0; k < 2; ++k) spot.scale[k] = extents[i][k] > 0.0 ? texels[k] / extents[i][k] : 0.0;
    }
    std::vector<std::uint32_t> order(extents.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::tuple(spots[b].height, spots[b].width, a) < std::tuple(spots[a].height, spots[a].width, b);
    });
    Skyline skyline(size);
    for (const std::uint32_t i : order) {
        if (!skyline.place(spots[i].width, spots[i].height, spots[i].x, spots[i].y)) return false;
        spots[i].at = glm::dvec2(spots[i].x, spots[i].y);
    }
    return true;
}

}  // namespace

Result<std::vector<ChartSpot>> layOut(const std::vector<glm::dvec2>& extents, std::uint32_t size) {
    std::vector<ChartSpot> spots;
    double area = 0.0, longest = 0.0;
    for (const glm::dvec2& extent : extents) {
        area += extent.x * extent.y;
        longest = std::max({longest, extent.x, extent.y});
    }
    if (extents.empty()) return spots;
    const double side = size;
    // No denser layout can fit.
    const double densest = longest > 0.0 ? std::min(side / longest, area > 0.0 ? side / std::sqrt(area) : 1e300) : 1.0;
    const auto densityOf = [&](int step) { return densest * std::exp2(-step / 8.0); };
    constexpr int kCoarsest = 320;  // 2^-40
    if (!tryLayOut(extents, size, densityOf(kCoarsest), spots)) {
        const auto least = static_cast<std::uint32_t>(std::ceil(std::sqrt(static_cast<double>(extents.size()))));
        return badInput(
            fmt::format("a light map of {} x {} texels is too small for the {} charts of this scene: it "
                        "takes at least {}, and many more for edges to be seen",
                        size, size, extents.size(), least));
    }
    int fails = -1, fits = kCoarsest;
    while (fits - fails > 1) {
        const int middle = (fits + fails) / 2;
        (tryLayOut(extents, size, densityOf(middle), spots) ? fits : fails) = middle;
    }
    const bool done = tryLayOut(extents, size, densityOf(fits), spots);
    UMBRIEL_ASSERT(done, "what fitted before fits again");
    return spots;
}

}  // namespace umbriel
