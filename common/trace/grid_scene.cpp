#include "common/trace/grid_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/base/assert.h"
#include "common/trace/double_hit.h"

namespace umbriel::trace {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMostCells = 256;  // along an axis

// Calls visit(cell) for each cell that the box of a triangle touches.
template <class Visit>
void eachCell(const glm::ivec3& low, const glm::ivec3& high, Visit visit) {
    for (int z = low.z; z <= high.z; ++z) {
        for (int y = low.y; y <= high.y; ++y) {
            for (int x = low.x; x <= high.x; ++x) visit(glm::ivec3(x, y, z));
        }
    }
}

}  // namespace

GridScene::GridScene(const Triangles& triangles) : _triangles(triangles) {
    UMBRIEL_ASSERT(!triangles.corners.empty(), "a grid without triangles");
    glm::dvec3 low(kInfinity), high(-kInfinity);
    for (const glm::vec3& p : triangles.positions) {
        low = glm::min(low, glm::dvec3(p));
        high = glm::max(high, glm::dvec3(p));
    }
    _diagonal = glm::length(high - low);
    // A little larger, so that no point lies on the outer faces and no axis is without extent.
    low -= glm::dvec3(1e-6 * _diagonal);
    high += glm::dvec3(1e-6 * _diagonal);
    const glm::dvec3 extent = high - low;
    // About two cells for each triangle, as cubic as the box allows.
    const double edge = std::cbrt(std::max(extent.x * extent.y * extent.z, 1e-9 * std::pow(_diagonal, 3)) /
                                  (2.0 * static_cast<double>(triangles.corners.size())));
    for (int axis = 0; axis < 3; ++axis) {
        _cells[axis] =
            static_cast<int>(std::clamp(std::ceil(extent[axis] / edge), 1.0, static_cast<double>(kMostCells)));
    }
    _low = low;
    _cellSize = extent / glm::dvec3(_cells);

    std::vector<std::uint32_t> count(static_cast<std::size_t>(_cells.x) * _cells.y * _cells.z + 1, 0);
    const auto range = [&](const glm::uvec3& t) {
        const glm::dvec3 a(triangles.positions[t.x]), b(triangles.positions[t.y]), c(triangles.positions[t.z]);
        // Neighbours of a face are included: the walk may be on either side of it by rounding.
        const glm::dvec3 pad = _cellSize * 1e-9;
        return std::pair{cellOf(glm::min(glm::min(a, b), c) - pad), cellOf(glm::max(glm::max(a, b), c) + pad)};
    };
    for (const glm::uvec3& t : triangles.corners) {
        const auto [from, to] = range(t);
        eachCell(from, to, [&](const glm::ivec3& cell) { ++count[index(cell) + 1]; });
    }
    std::partial_sum(count.begin(), count.end(), count.begin());
    _begin = count;
    _inCell.resize(_begin.back());
    for (std::uint32_t t = 0; t < triangles.corners.size(); ++t) {
        const auto [from, to] = range(triangles.corners[t]);
        eachCell(from, to, [&](const glm::ivec3& cell) { _inCell[count[index(cell)]++] = t; });
    }
}

glm::ivec3 GridScene::cellOf(const glm::dvec3& point) const {
    const glm::dvec3 cell = glm::floor((point - _low) / _cellSize);
    return glm::ivec3(glm::clamp(cell, glm::dvec3(0.0), glm::dvec3(_cells - 1)));
}

bool GridScene::Tracer::hit(const Origin& origin, const glm::dvec3& direction, double farDistance) const {
    const GridScene& s = _scene;
    const glm::dvec3 from(s._triangles.positions[origin.position]);
    glm::ivec3 cell = s.cellOf(from);
    glm::ivec3 step;
    glm::dvec3 next, between;  // distance to the next wall of each axis, and from wall to wall; infinite along an axis
    for (int axis = 0; axis < 3; ++axis) {
        step[axis] = direction[axis] > 0.0 ? 1 : -1;
        if (direction[axis] == 0.0) {
            next[axis] = between[axis] = kInfinity;
            continue;
        }
        const double wall = s._low[axis] + (cell[axis] + (step[axis] > 0 ? 1 : 0)) * s._cellSize[axis];
        next[axis] = (wall - from[axis]) / direction[axis];
        between[axis] = s._cellSize[axis] / std::abs(direction[axis]);
    }
    double entered = 0.0;
    while (entered <= farDistance) {
        const std::size_t index = s.index(cell);
        for (std::uint32_t i = s._begin[index]; i < s._begin[index + 1]; ++i) {
            const glm::uvec3& t = s._triangles.corners[s._inCell[i]];
            if (t.x == origin.position || t.y == origin.position || t.z == origin.position) continue;
            const auto corner = [&](std::uint32_t p) { return glm::dvec3(s._triangles.positions[p]) - from; };
            // A hit in another cell counts as well: any hit blocks.
            const auto distance = hitDistance(direction, corner(t.x), corner(t.y), corner(t.z));
            if (distance && *distance <= farDistance) return true;
        }
        const int axis = next.x < next.y ? (next.x < next.z ? 0 : 2) : (next.y < next.z ? 1 : 2);
        cell[axis] += step[axis];
        if (cell[axis] < 0 || cell[axis] >= s._cells[axis]) return false;
        entered = next[axis];
        next[axis] += between[axis];
    }
    return false;
}

void GridScene::Tracer::blocked(const Origin& origin, std::span<const std::uint32_t> own, const DirectionPackets& set,
                                double farDistance, std::span<std::uint8_t> blocked) {
    const glm::dvec3 from(_scene._triangles.positions[origin.position]);
    _edges.clear();
    for (const std::uint32_t triangle : own) {
        const glm::uvec3& t = _scene._triangles.corners[triangle];
        const int apex = t.x == origin.position ? 0 : t.y == origin.position ? 1 : 2;
        _edges.push_back(glm::dvec3(_scene._triangles.positions[t[(apex + 1) % 3]]) - from);
        _edges.push_back(glm::dvec3(_scene._triangles.positions[t[(apex + 2) % 3]]) - from);
    }
    _fan.reset(origin, _edges);
    _fan.blocked(set, blocked);
    for (std::size_t packet = 0; packet < set.packets(); ++packet) {
        for (std::size_t i = 0; i < kPacket; ++i) {
            const std::size_t lane = packet * kPacket + i;
            const auto bit = static_cast<std::uint8_t>(1u << i);
            if (set.pixel[lane] == kNoPixel) {
                blocked[packet] &= static_cast<std::uint8_t>(~bit);
            } else if ((blocked[packet] & bit) == 0) {
                const glm::dvec3 d(worldDirection(origin, set.x[lane], set.y[lane], set.z[lane]));
                if (hit(origin, d, farDistance)) blocked[packet] |= bit;
            }
        }
    }
}

}  // namespace umbriel::trace
