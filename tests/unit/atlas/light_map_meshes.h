#pragma once

#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "client/bake/light_map_bake.h"

namespace umbriel {

// Around the origin; vertices are the faces' own.
inline ChartMesh cubeMesh(double side, const glm::dvec3& middle = glm::dvec3(0.0)) {
    ChartMesh mesh;
    for (int axis = 0; axis < 3; ++axis)
        for (const double sign : {-1.0, 1.0}) {
            glm::dvec3 normal(0.0), u(0.0), v(0.0);
            normal[axis] = sign;
            u[(axis + 1) % 3] = 1.0;
            v[(axis + 2) % 3] = sign;
            const auto first = static_cast<std::uint32_t>(mesh.positions.size());
            for (const glm::dvec2 corner : {glm::dvec2(-1, -1), glm::dvec2(1, -1), glm::dvec2(1, 1), glm::dvec2(-1, 1)})
                mesh.positions.push_back(middle + 0.5 * side * (normal + u * corner.x + v * corner.y));
            mesh.triangles.push_back({first, first + 1, first + 2});
            mesh.triangles.push_back({first, first + 2, first + 3});
        }
    return mesh;
}

inline ChartMesh sphereMesh(double radius, int columns, int rows) {
    ChartMesh mesh;
    const auto at = [&](int column, int row) {
        const double polar = std::numbers::pi * row / rows,
                     angle = 2.0 * std::numbers::pi * (column % columns) / columns;
        return radius *
               glm::dvec3(std::sin(polar) * std::cos(angle), std::cos(polar), -std::sin(polar) * std::sin(angle));
    };
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) {
            const auto first = static_cast<std::uint32_t>(mesh.positions.size());
            mesh.positions.insert(mesh.positions.end(),
                                  {at(column, row), at(column, row + 1), at(column + 1, row + 1), at(column + 1, row)});
            if (row + 1 < rows) mesh.triangles.push_back({first, first + 1, first + 2});
            if (row > 0) mesh.triangles.push_back({first, first + 2, first + 3});
        }
    return mesh;
}

// A square in a plane of constant y, facing up, with the origin's x and z in its middle.
inline ChartMesh squareMesh(double half, double y) {
    ChartMesh mesh;
    mesh.positions = {{-half, y, half}, {half, y, half}, {half, y, -half}, {-half, y, -half}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

// Surfaces and the rays that see them all.
struct LightMapScene {
    std::vector<LightMapSurface> surfaces;
    std::unique_ptr<trace::OcclusionScene> rays;
};
inline LightMapScene sceneOf(const std::vector<ChartMesh>& meshes, std::size_t lights) {
    LightMapScene scene;
    std::vector<glm::dvec3> positions;
    std::vector<glm::uvec3> corners;
    for (const ChartMesh& mesh : meshes) {
        LightMapSurface surface;
        surface.mesh = mesh;
        surface.objectPositions = mesh.positions;
        surface.lit.assign(lights, 1);
        for (const glm::uvec3& t : mesh.triangles) {
            surface.rayTriangles.push_back(static_cast<std::uint32_t>(corners.size()));
            corners.push_back(t + static_cast<std::uint32_t>(positions.size()));
        }
        positions.insert(positions.end(), mesh.positions.begin(), mesh.positions.end());
        scene.surfaces.push_back(std::move(surface));
    }
    scene.rays = std::move(*trace::OcclusionScene::create(positions, corners));
    return scene;
}

// What the shader finds for a point of a triangle (numbered over all surfaces): shaders/snippet/shadow_light_map.glsl.
inline glm::vec2 placeOf(const BakedLightMap& map, std::size_t triangle, const glm::vec3& object) {
    const std::size_t chart = 3 * std::size_t{map.places[triangle]};
    const glm::vec4 place(object, 1.0f), range = map.charts[chart + 2];
    const glm::vec2 texel(glm::dot(map.charts[chart], place), glm::dot(map.charts[chart + 1], place));
    return glm::clamp(texel, glm::vec2(range.x, range.y), glm::vec2(range.z, range.w));
}
inline double lookUp(const BakedLightMap& map, std::size_t light, std::size_t triangle, const glm::vec3& object) {
    const glm::dvec2 at = glm::dvec2(placeOf(map, triangle, object)) - 0.5;
    const glm::dvec2 first = glm::floor(at), weight = at - first;
    const auto texel = [&](int dx, int dy) {
        const auto clamped = [&](double v) {
            return static_cast<std::size_t>(std::clamp(v, 0.0, static_cast<double>(map.size) - 1.0));
        };
        const std::size_t x = clamped(first.x + dx), y = clamped(first.y + dy);
        return static_cast<double>(map.texels[light * map.size * map.size + y * map.size + x]) / 255.0;
    };
    return (1 - weight.y) * ((1 - weight.x) * texel(0, 0) + weight.x * texel(1, 0)) +
           weight.y * ((1 - weight.x) * texel(0, 1) + weight.x * texel(1, 1));
}

}  // namespace umbriel
