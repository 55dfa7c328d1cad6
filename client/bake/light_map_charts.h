#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "common/math/glm.h"

namespace umbriel {

// A surface that gets its place in an atlas.
struct ChartMesh {
    std::vector<glm::dvec3> positions;  // world, metres
    std::vector<glm::uvec3> triangles;  // those with a corner beyond the positions have no area
    std::vector<glm::dvec2> texCoords;  // by vertex (TEXCOORD_1); empty: none
};

// Triangles that lie flat beside each other, none over another.
struct Chart {
    std::vector<std::uint32_t> triangles;  // of the mesh
    std::vector<glm::dvec2> corners;       // three each: where they lie, metres, in [0, extent]
    glm::dvec2 extent{0.0};
    // Of a chart that is a projection along a direction: corner = (u . p, v . p) - origin.
    struct Projection {
        glm::dvec3 u{0.0}, v{0.0};  // unit, across each other
        glm::dvec2 origin{0.0};
    };
    std::optional<Projection> projection;  // none: it lies as its texture coordinates say
};

// A chart's triangles turn from the direction it is seen along by at most this: its sides shrink to 3/4 at most.
inline constexpr double kChartCosine = 0.75;

// Whether the texture coordinates give every point of the surface a place of its own: within the unit square, and no
// triangle over another.
bool areUnique(const ChartMesh& mesh);

// All triangles with an area, in charts. Where the texture coordinates are unique, their islands are the charts, each
// scaled to the size of its surface; otherwise a chart grows from its first triangle over those that share an edge (of
// equal positions), turn from it by at most kChartCosine and do not come to lie over one another, and is seen along
// that first one's normal. The same mesh gives the same charts.
std::vector<Chart> chartsOf(const ChartMesh& mesh);

// A chart's place in an atlas: place in texels = at + scale * corner.
struct ChartSpot {
    glm::dvec2 at{0.0};
    glm::dvec2 scale{0.0};  // texels a metre
    std::uint32_t x = 0, y = 0, width = 0, height = 0;
};

// Places for charts of these extents in an atlas of size x size texels, as many texels a metre as fit (in steps of
// 2^(1/8)), the same for all; sides are stretched to whole texels. Bad input when the charts are more than the texels.
Result<std::vector<ChartSpot>> layOut(const std::vector<glm::dvec2>& extents, std::uint32_t size);

}  // namespace umbriel
