#pragma once

#include <cstdint>
#include <vector>

#include "common/math/glm.h"
#include "common/trace/triangles.h"

namespace umbriel::visibility {

// Triangles sorted into the cells of a grid, so that a rasteriser leaves out those that a picture cannot show (Ganster
// 2002, 2.1.1, where each cell is a display list). Each triangle is in one cell, the one its centre lies in.
struct TriangleCells {
    struct Cell {
        glm::vec3 centre{0.0f}, halfSize{0.0f};  // of the box around its triangles
        std::uint32_t firstIndex = 0;
        std::uint32_t indexCount = 0;
    };
    std::vector<glm::vec3> positions;    // those of a cell next to each other, so those of borders several times
    std::vector<std::uint32_t> indices;  // three for each triangle, by cells
    std::vector<Cell> cells;             // none is empty

    // About trianglesPerCell in each where they are evenly spread.
    static TriangleCells make(const trace::Triangles& triangles, std::uint32_t trianglesPerCell);
};

// What a view shows: the points p with normal . (p - eye) >= 0 for each of four planes, within a radius.
struct ViewPyramid {
    glm::vec3 eye{0.0f};
    glm::vec3 normals[4];
    float radius = 0.0f;  // may be infinite
    // How far boxes may seem to lie outside by rounding: a length.
    float slack = 0.0f;
    // False only when nothing of the cell's box is in it.
    bool mayShow(const TriangleCells::Cell& cell) const;
};

}  // namespace umbriel::visibility
