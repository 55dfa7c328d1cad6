#include "common/visibility/triangle_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace umbriel::visibility {
namespace {

// More would only cost time on meshes that are spread unevenly.
constexpr double kMostCells = 64.0;

}  // namespace

TriangleCells TriangleCells::make(const trace::Triangles& triangles, std::uint32_t trianglesPerCell) {
    const std::size_t count = triangles.corners.size();
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
    std::vector<glm::dvec3> centre(count);
    for (std::size_t i = 0; i < count; ++i) {
        const glm::uvec3& t = triangles.corners[i];
        centre[i] = (glm::dvec3(triangles.positions[t.x]) + glm::dvec3(triangles.positions[t.y]) +
                     glm::dvec3(triangles.positions[t.z])) /
                    3.0;
        low = glm::min(low, centre[i]);
        high = glm::max(high, centre[i]);
    }
    TriangleCells out;
    if (count == 0) return out;
    // A surface of n x n x n cells fills about 6 n^2 of them; flat directions get one layer.
    const double edges = std::clamp(std::sqrt(static_cast<double>(count) / (6.0 * trianglesPerCell)), 1.0, kMostCells);
    const glm::dvec3 extent = high - low;
    const double widest = std::max({extent.x, extent.y, extent.z, std::numeric_limits<double>::min()});
    const double edge = widest / std::ceil(1.5 * edges);
    const glm::ivec3 cells = glm::max(glm::ivec3(glm::ceil(extent / edge)), glm::ivec3(1));
    const auto cellOf = [&](std::size_t i) {
        const glm::ivec3 c = glm::clamp(glm::ivec3((centre[i] - low) / edge), glm::ivec3(0), cells - 1);
        return (static_cast<std::uint32_t>(c.z) * cells.y + c.y) * cells.x + c.x;
    };
    std::vector<std::uint32_t> cell(count), order(count);
    for (std::size_t i = 0; i < count; ++i) cell[i] = cellOf(i);
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::stable_sort(order, {}, [&](std::uint32_t i) { return cell[i]; });

    constexpr std::uint32_t kNone = ~0u;
    std::vector<std::uint32_t> now(triangles.positions.size(), kNone);  // in this cell
    for (std::size_t begin = 0; begin < count;) {
        std::size_t end = begin;
        Cell c;
        c.firstIndex = static_cast<std::uint32_t>(out.indices.size());
        glm::vec3 boxLow(std::numeric_limits<float>::infinity()), boxHigh(-boxLow);
        const std::size_t firstPosition = out.positions.size();
        std::vector<std::uint32_t> used;
        for (; end < count && cell[order[end]] == cell[order[begin]]; ++end) {
            const glm::uvec3& t = triangles.corners[order[end]];
            for (int corner = 0; corner < 3; ++corner) {
                std::uint32_t& place = now[t[corner]];
                if (place == kNone) {
                    place = static_cast<std::uint32_t>(out.positions.size());
                    out.positions.push_back(triangles.positions[t[corner]]);
                    used.push_back(t[corner]);
                }
                out.indices.push_back(place);
            }
        }
        for (std::size_t i = firstPosition; i < out.positions.size(); ++i) {
            boxLow = glm::min(boxLow, out.positions[i]);
            boxHigh = glm::max(boxHigh, out.positions[i]);
        }
        for (const std::uint32_t position : used) now[position] = kNone;
        c.indexCount = static_cast<std::uint32_t>(out.indices.size()) - c.firstIndex;
        c.centre = 0.5f * (boxLow + boxHigh);
        c.halfSize = glm::max(boxHigh - c.centre, c.centre - boxLow);
        out.cells.push_back(c);
        begin = end;
    }
    return out;
}

bool ViewPyramid::mayShow(const TriangleCells::Cell& cell) const {
    const glm::vec3 c = cell.centre - eye;
    for (const glm::vec3& n : normals) {
        if (glm::dot(n, c) + glm::dot(glm::abs(n), cell.halfSize) < -slack) return false;
    }
    const glm::vec3 nearest = glm::max(glm::abs(c) - cell.halfSize, glm::vec3(0.0f));
    return glm::dot(nearest, nearest) <= (radius + slack) * (radius + slack);
}

}  // namespace umbriel::visibility
