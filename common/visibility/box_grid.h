#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/math/glm.h"

namespace umbriel::visibility {

// An axis-aligned box; its faces belong to it.
struct Box {
    glm::dvec3 low{0.0};
    glm::dvec3 high{0.0};
    bool overlaps(const Box& other) const {
        return low.x <= other.high.x && other.low.x <= high.x && low.y <= other.high.y && other.low.y <= high.y &&
               low.z <= other.high.z && other.low.z <= high.z;
    }
};

// Finds which of many boxes overlap a box: a uniform grid with about two cells for each box.
class BoxGrid {
 public:
    explicit BoxGrid(std::vector<Box> boxes);

    // Calls visit(index) once for every box that overlaps, in an order that depends on the boxes alone.
    template <class Visit>
    void eachOverlap(const Box& box, Visit visit) const {
        if (_boxes.empty()) return;
        const glm::ivec3 from = cellOf(box.low), to = cellOf(box.high);
        for (int z = from.z; z <= to.z; ++z) {
            for (int y = from.y; y <= to.y; ++y) {
                for (int x = from.x; x <= to.x; ++x) {
                    const std::size_t cell = index({x, y, z});
                    for (std::uint32_t i = _begin[cell]; i < _begin[cell + 1]; ++i) {
                        const Box& other = _boxes[_inCell[i]];
                        // Only in the cell that holds the low corner of what they share.
                        if (other.overlaps(box) && cellOf(glm::max(other.low, box.low)) == glm::ivec3(x, y, z)) {
                            visit(_inCell[i]);
                        }
                    }
                }
            }
        }
    }

    // How many boxes eachOverlap() looks at when it is called with each of the boxes.
    std::uint64_t visits() const {
        std::uint64_t sum = 0;
        for (std::size_t cell = 0; cell + 1 < _begin.size(); ++cell) {
            const std::uint64_t count = _begin[cell + 1] - _begin[cell];
            sum += count * count;
        }
        return sum;
    }

 private:
    std::vector<Box> _boxes;
    glm::dvec3 _low{0.0};
    glm::dvec3 _cellSize{1.0};
    glm::ivec3 _cells{1};
    std::vector<std::uint32_t> _begin, _inCell;

    std::size_t index(const glm::ivec3& c) const {
        return (static_cast<std::size_t>(c.z) * _cells.y + c.y) * _cells.x + c.x;
    }
    glm::ivec3 cellOf(const glm::dvec3& p) const {
        return glm::ivec3(glm::clamp(glm::floor((p - _low) / _cellSize), glm::dvec3(0.0), glm::dvec3(_cells - 1)));
    }
};

}  // namespace umbriel::visibility
