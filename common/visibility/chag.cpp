#include "common/visibility/chag.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace umbriel::visibility {

double steepestAngle(const BakeMesh& mesh, std::uint32_t row, bool lower) {
    const Row& r = mesh.rows[row];
    const glm::dvec3 n(lower ? -r.normal : r.normal), p(mesh.positions[r.position]);
    double smallest = std::numbers::pi;
    const auto angleTo = [&](const glm::dvec3& d) { return std::atan2(glm::length(glm::cross(n, d)), glm::dot(n, d)); };
    for (const std::uint32_t triangle : mesh.ownTriangles(r.position)) {
        const glm::uvec3& t = mesh.triangles[triangle];
        const int apex = t.x == r.position ? 0 : t.y == r.position ? 1 : 2;
        const glm::dvec3 e0 = glm::dvec3(mesh.positions[t[(apex + 1) % 3]]) - p;
        const glm::dvec3 e1 = glm::dvec3(mesh.positions[t[(apex + 2) % 3]]) - p;
        smallest = std::min({smallest, angleTo(e0), angleTo(e1)});
        // The steepest line of the plane, if it lies between the edges.
        const glm::dvec3 q = glm::cross(e0, e1);
        const glm::dvec3 up = n - q * (glm::dot(n, q) / glm::dot(q, q));
        if (glm::dot(glm::cross(e0, up), q) > 0.0 && glm::dot(glm::cross(up, e1), q) > 0.0) {
            smallest = std::min(smallest, angleTo(up));
        }
    }
    return smallest;
}

double cameraHeight(MappingKind kind, double fovy, double alpha, double near, double epsilon) {
    if (!(alpha > 0.0 && alpha < 0.5 * std::numbers::pi)) return epsilon;
    const double rise = std::numbers::sqrt2 / std::tan(alpha);
    const double height = kind == MappingKind::SinglePlane ? near * (rise * std::tan(0.5 * fovy) - 1.0) : near * rise;
    return std::max(height, epsilon);
}

double cameraHeightAllAround(double alpha, double near, double epsilon) {
    if (!(alpha > 0.0)) return epsilon;
    return std::max(std::numbers::sqrt3 * near / std::sin(std::min(alpha, 0.5 * std::numbers::pi)), epsilon);
}

}  // namespace umbriel::visibility
