#include "common/visibility/box_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace umbriel::visibility {
namespace {

constexpr double kMostCells = 160.0;  // along an axis: 4 million, 16 MiB

}  // namespace

BoxGrid::BoxGrid(std::vector<Box> boxes) : _boxes(std::move(boxes)) {
    if (_boxes.empty()) return;
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
    for (const Box& box : _boxes) {
        low = glm::min(low, box.low);
        high = glm::max(high, box.high);
    }
    const double diagonal = std::max(glm::length(high - low), 1e-300);
    const glm::dvec3 extent = glm::max(high - low, glm::dvec3(1e-3 * diagonal));
    const double edge = std::cbrt(extent.x * extent.y * extent.z / (2.0 * static_cast<double>(_boxes.size())));
    _low = low;
    _cells = glm::ivec3(glm::clamp(glm::ceil(extent / edge), glm::dvec3(1.0), glm::dvec3(kMostCells)));
    _cellSize = extent / glm::dvec3(_cells);
    std::vector<std::uint32_t> count(static_cast<std::size_t>(_cells.x) * _cells.y * _cells.z + 1, 0);
    const auto each = [&](const Box& box, auto visit) {
        const glm::ivec3 from = cellOf(box.low), to = cellOf(box.high);
        for (int z = from.z; z <= to.z; ++z) {
            for (int y = from.y; y <= to.y; ++y) {
                for (int x = from.x; x <= to.x; ++x) visit(index({x, y, z}));
            }
        }
    };
    for (const Box& box : _boxes) each(box, [&](std::size_t cell) { ++count[cell + 1]; });
    std::partial_sum(count.begin(), count.end(), count.begin());
    _begin = count;
    _inCell.resize(_begin.back());
    for (std::uint32_t i = 0; i < _boxes.size(); ++i) {
        each(_boxes[i], [&](std::size_t cell) { _inCell[count[cell]++] = i; });
    }
}

}  // namespace umbriel::visibility
