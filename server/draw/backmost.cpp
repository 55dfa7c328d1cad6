#include "server/draw/backmost.h"

#include <algorithm>

namespace umbriel {
namespace {

// Of floats in a scene of some size, and of doubles at a place.
constexpr double kFloatRounding = 2.5e-7;
constexpr double kDoubleRounding = 1e-14;

}  // namespace

BoxFaces faceUnder(const Box& part, const Box& whole) {
    for (int axis = 0; axis < 3; ++axis) {
        if (part.minimum[axis] != part.maximum[axis] || whole.minimum[axis] == whole.maximum[axis]) continue;
        if (part.minimum[axis] == whole.minimum[axis]) return static_cast<BoxFaces>(1 << (2 * axis));
        if (part.minimum[axis] == whole.maximum[axis]) return static_cast<BoxFaces>(2 << (2 * axis));
    }
    // All of it is flat: either side is.
    for (int axis = 0; axis < 3; ++axis)
        if (whole.minimum[axis] == whole.maximum[axis]) return static_cast<BoxFaces>(1 << (2 * axis));
    return 0;
}

BoxFaces flatFacesOf(std::span<const Cluster> clusters, const Box& whole) {
    BoxFaces faces = 0;
    for (const Cluster& cluster : clusters) faces |= faceUnder(cluster.box, whole);
    return faces;
}

BoxFaces backmostFaces(BoxFaces faces, const Box& item, const glm::dmat4& worldFromObject, const Box3d& scene,
                       const ShadowFit& fit) {
    BoxFaces backmost = 0;
    if (faces == 0 || item.empty() || scene.empty()) return backmost;
    const double rounding = kFloatRounding * scene.diagonal() +
                            kDoubleRounding * std::max(glm::length(scene.lower), glm::length(scene.upper));
    for (int axis = 0; axis < 3; ++axis) {
        // The plane of the face, turned towards the light.
        const glm::dvec3 along(worldFromObject[(axis + 1) % 3]);
        const glm::dvec3 across(worldFromObject[(axis + 2) % 3]);
        const glm::dvec3 normal = glm::cross(along, across);
        const double length = glm::length(normal);
        if (!(length > 0.0)) continue;
        for (int side = 0; side < 2; ++side) {
            const auto face = static_cast<BoxFaces>((1 + side) << (2 * axis));
            if ((faces & face) == 0) continue;
            glm::dvec3 on(item.minimum);
            on[axis] = side == 0 ? item.minimum[axis] : item.maximum[axis];
            const glm::dvec3 onWorld(worldFromObject * glm::dvec4(on, 1.0));
            const double towards = glm::dot(normal, fit.perspective ? fit.positionWorld - onWorld : fit.worldFromLight[2]);
            if (towards == 0.0) continue;
            const glm::dvec3 n = normal * ((towards > 0.0 ? 1.0 : -1.0) / length);
            glm::dvec3 deepest;
            for (int i = 0; i < 3; ++i) deepest[i] = n[i] > 0.0 ? scene.lower[i] : scene.upper[i];
            if (glm::dot(n, deepest - onWorld) >= -rounding) backmost |= face;
        }
    }
    return backmost;
}

}  // namespace umbriel
