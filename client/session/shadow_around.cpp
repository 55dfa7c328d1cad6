#include "client/session/shadow_around.h"

#include <algorithm>
#include <cmath>

#include "client/session/shadow_body.h"
#include "common/math/rotation.h"

namespace umbriel {

namespace {

// Biases move a surface by less than this many texels.
constexpr double kBorderTexels = 3.0;

// The farthest corner of the scene within the range; 0 when there is nothing.
double reachOf(const glm::dvec3& positionWorld, double range, const Box3d& sceneBounds) {
    if (sceneBounds.empty() || !isFinite(positionWorld)) return 0.0;
    double farthest = 0.0;
    for (int i = 0; i < 8; ++i) farthest = std::max(farthest, glm::distance(positionWorld, sceneBounds.corner(i)));
    return range > 0.0 ? std::min(farthest, range) : farthest;
}

}  // namespace

std::vector<ShadowFit> fitCube(const glm::dvec3& positionWorld, double range, const Box3d& sceneBounds,
                               const ShadowFitRequest& request) {
    std::vector<ShadowFit> faces;
    const double farDistance = 1.001 * reachOf(positionWorld, range, sceneBounds);
    if (!(farDistance > 0.0)) return faces;
    const double border = std::min((kBorderTexels + request.borderTexels) / request.mapSize, 0.25);
    for (std::uint32_t part = 0; part < 6; ++part) {
        glm::dvec3 axis(0.0);
        axis[static_cast<int>(part / 2)] = part % 2 == 0 ? 1.0 : -1.0;
        LightBody body;
        body.perspective = true;
        body.worldFromLight = *rotationLookingAlong(axis, part / 2 == 1 ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0));
        body.originWorld = positionWorld;
        body.farDistance = farDistance;
        body.nearDistance = 2e-5 * farDistance;
        glm::dmat3 clipFromAcross(1.0);
        clipFromAcross[0][0] = clipFromAcross[1][1] = 1.0 - 2.0 * border;
        auto fit = composeFit(body, clipFromAcross, request);
        if (!fit) return {};
        fit->shape = ShadowShape::CubeFace;
        fit->part = part;
        faces.push_back(*fit);
    }
    return faces;
}

std::vector<ShadowFit> fitHemispheres(const glm::dvec3& positionWorld, double range, const Box3d& sceneBounds,
                                      const ShadowFitRequest& request) {
    std::vector<ShadowFit> halves;
    const double farDistance = 1.001 * reachOf(positionWorld, range, sceneBounds);
    if (!(farDistance > 0.0)) return halves;
    for (std::uint32_t part = 0; part < 2; ++part) {
        LightBody body;
        body.perspective = true;
        body.worldFromLight = part == 0 ? glm::dmat3(1.0) : glm::dmat3(-1, 0, 0, 0, 1, 0, 0, 0, -1);
        body.originWorld = positionWorld;
        body.farDistance = farDistance;
        body.nearDistance = 2e-5 * farDistance;
        // The rim, where a hemisphere ends, has a border so that its texels have neighbours.
        const double border = std::min((kBorderTexels + request.borderTexels) / request.mapSize, 0.25);
        glm::dmat3 clipFromAcross(1.0);
        clipFromAcross[0][0] = clipFromAcross[1][1] = 1.0 - 2.0 * border;
        auto fit = composeFit(body, clipFromAcross, request);
        if (!fit) return {};
        fit->shape = ShadowShape::Hemisphere;
        fit->part = part;
        halves.push_back(*fit);
    }
    return halves;
}

}  // namespace umbriel
