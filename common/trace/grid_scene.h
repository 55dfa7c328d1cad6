#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/trace/direction_packets.h"
#include "common/trace/fan.h"
#include "common/trace/triangles.h"

namespace umbriel::trace {

// Rays against triangles through a uniform grid of cells, in double: the way of the thesis (Ganster 2002, 2.1.2), with
// Amanatides and Woo's step (1987) in place of his, which divides by zero along axes and drifts. Slower than RayScene;
// it shows what a tree buys and finds the same as its exact guard by other means. Immutable; trace from any thread.
class GridScene {
 public:
    // Triangles are borrowed and must outlive the scene.
    explicit GridScene(const Triangles& triangles);

    double diagonal() const { return _diagonal; }
    glm::ivec3 cells() const { return _cells; }

    // As RayScene::Tracer: rays end at farDistance, which is also the radius beyond which no cell is looked at.
    class Tracer {
     public:
        explicit Tracer(const GridScene& scene) : _scene(scene) {}
        void blocked(const Origin& origin, std::span<const std::uint32_t> own, const DirectionPackets& directions,
                     double farDistance, std::span<std::uint8_t> blocked);

     private:
        const GridScene& _scene;
        Fan _fan;
        std::vector<glm::dvec3> _edges;
        bool hit(const Origin& origin, const glm::dvec3& direction, double farDistance) const;
    };

 private:
    Triangles _triangles;
    glm::dvec3 _low{0.0};
    glm::dvec3 _cellSize{1.0};
    glm::ivec3 _cells{1};
    double _diagonal = 0.0;
    std::vector<std::uint32_t> _begin;  // of each cell, in _inCell
    std::vector<std::uint32_t> _inCell;

    std::size_t index(const glm::ivec3& cell) const {
        return (static_cast<std::size_t>(cell.z) * _cells.y + cell.y) * _cells.x + cell.x;
    }
    glm::ivec3 cellOf(const glm::dvec3& point) const;
};

}  // namespace umbriel::trace
