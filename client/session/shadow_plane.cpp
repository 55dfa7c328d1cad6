#include "client/session/shadow_plane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace umbriel {
namespace {

// Faces whose planes agree so well are one: directions in radians, offsets as a share of the scene's diagonal.
constexpr double kSameNormal = 1e-3;
constexpr double kSameOffset = 1e-4;
// So much of the scene's diagonal may lie behind the plane: what stands on it is rarely modelled to the millimetre.
constexpr double kBehind = 1e-2;

struct Face {
    double area = 0.0;
    glm::dvec3 normal{0.0};  // sums, weighted by area
    double offset = 0.0;
};

using Key = std::array<std::int64_t, 4>;

Key keyOf(const glm::dvec3& normal, double offset, double diagonal) {
    const auto step = [](double value, double size) { return static_cast<std::int64_t>(std::llround(value / size)); };
    return {step(normal.x, kSameNormal), step(normal.y, kSameNormal), step(normal.z, kSameNormal),
            step(offset, kSameOffset * diagonal)};
}

bool isLit(const glm::dvec4& plane, const LightInEffect& light) {
    if (light.kind == LightKind::Ambient) return false;
    if (light.kind == LightKind::Directional) return glm::dot(glm::dvec3(plane), light.directionWorld) < -1e-6;
    return glm::dot(glm::dvec3(plane), light.positionWorld) + plane.w > 0.0;
}

// How far the box reaches from its middle along a direction.
double reachAlong(const Box3d& box, const glm::dvec3& normal) {
    return glm::dot(glm::abs(normal), 0.5 * (box.upper - box.lower));
}

}  // namespace

glm::dvec4 towardsLights(const glm::dvec4& planeWorld, const std::vector<LightInEffect>& lights) {
    const auto shinesOn = [](const glm::dvec4& plane, bool sunsOnly) {
        return [&plane, sunsOnly](const LightInEffect& light) {
            return light.castsShadow && (!sunsOnly || light.kind == LightKind::Directional) && isLit(plane, light);
        };
    };
    const glm::dvec4 other = -planeWorld;
    const bool isTurned = std::ranges::any_of(lights, shinesOn(other, true)) &&
                          std::ranges::none_of(lights, shinesOn(planeWorld, false));
    return isTurned ? other : planeWorld;
}

bool touches(const glm::dvec4& planeWorld, const Box3d& box) {
    if (box.empty()) return false;
    const glm::dvec3 normal(planeWorld);
    return std::abs(glm::dot(normal, box.centre()) + planeWorld.w) <=
           reachAlong(box, normal) + kBehind * box.diagonal();
}

std::optional<glm::dvec4> largestLitPlane(const Aspect& aspect, Ref<Node> root, const Box3d& sceneBounds,
                                          const std::vector<LightInEffect>& lights) {
    if (sceneBounds.empty()) return std::nullopt;
    const double diagonal = sceneBounds.diagonal();
    const glm::dvec3 centre = sceneBounds.centre();
    std::map<Key, Face> faces;
    traverse(aspect, root, std::nullopt, [&](const VisitedNode& visited) {
        if (!visited.core || !isA<Geometry>(*visited.core)) return Descend::Yes;
        const auto& geometry = static_cast<const Geometry&>(*visited.core);
        const std::vector<glm::vec3> positions = geometry.positions.toVector();
        const std::vector<std::uint32_t> indices = geometry.indices.toVector();
        for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
            std::array<glm::dvec3, 3> corners;
            bool sound = true;
            for (std::size_t k = 0; k < 3; ++k) {
                sound = sound && indices[i + k] < positions.size();
                if (sound) corners[k] = visited.worldFromNode.point(positions[indices[i + k]]) - centre;
            }
            if (!sound) continue;
            const glm::dvec3 across = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
            const double area = 0.5 * glm::length(across);
            if (!(area > 0.0) || !std::isfinite(area)) continue;
            // Whichever way it is wound, the scene's middle is on the positive side.
            glm::dvec3 normal = across / (2.0 * area);
            double offset = -glm::dot(normal, corners[0]);
            if (offset < 0.0) {
                normal = -normal;
                offset = -offset;
            }
            Face& face = faces[keyOf(normal, offset, diagonal)];
            face.area += area;
            face.normal += area * normal;
            face.offset += area * offset;
        }
        return Descend::Yes;
    });
    std::optional<glm::dvec4> best;
    double bestArea = 0.0;
    for (const auto& [key, face] : faces) {
        if (face.area <= bestArea) continue;
        const double length = glm::length(face.normal);
        const glm::dvec3 normal = face.normal / length;
        const double fromCentre = face.offset / face.area;
        // How far the scene's box reaches behind the plane.
        if (reachAlong(sceneBounds, normal) - fromCentre > kBehind * diagonal) continue;
        const glm::dvec4 plane(normal, fromCentre - glm::dot(normal, centre));
        bool lit = false;
        for (const LightInEffect& light : lights) lit = lit || (light.castsShadow && isLit(plane, light));
        if (!lit) continue;
        best = plane;
        bestArea = face.area;
    }
    return best;
}

}  // namespace umbriel
