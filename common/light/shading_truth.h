#pragma once

#include <vector>

#include "common/scene/aspect.h"
#include "common/scene/materials.h"
#include "common/scene/traversal.h"

namespace umbriel {

// What the shaders should have computed: the same formulas (shaders/formula), of a scene's own fields, in double.
// Without shadows and textures: a caller passes the base colour with the texel in it, and the lights that reach the
// point.

// A place on a surface. Directions are unit vectors in world axes.
struct ShadedPoint {
    glm::dvec3 positionWorld{0.0};
    glm::dvec3 normalWorld{0.0, 0.0, 1.0};
    glm::dvec3 toEyeWorld{0.0, 0.0, 1.0};
    glm::dvec3 baseColour{1.0};
    glm::dvec3 tangentWorld{1.0, 0.0, 0.0};  // for Lafortune lobes with a grain; perpendicular to the normal
};

// Radiance towards the eye per irradiance on a surface that faces the light, 1/sr: the part that a shadow takes away.
// Zero for Unlit.
glm::dvec3 reflectedTruth(const Material& material, const ShadedPoint& point, const glm::dvec3& toLightWorld);

// Radiance towards the eye under ambient light of radiance 1. Zero for Unlit.
glm::dvec3 ambientTruth(const Material& material, const glm::dvec3& baseColour);

// What arrives from a light, not an ambient one, on a surface that faces it.
struct Arrival {
    glm::dvec3 toLightWorld{0.0};  // unit; zero on the light itself
    glm::dvec3 irradiance{0.0};    // W/m^2
    glm::dvec3 ambientShare{0.0};
    glm::dvec3 highlightShare{1.0};
};
Arrival arrivalTruth(const Aspect& aspect, const LightInEffect& light, const glm::dvec3& positionWorld);

// The radiance under these lights, with the material's emission; of Unlit the base colour.
glm::dvec3 radianceTruth(const Aspect& aspect, const Material& material, const ShadedPoint& point,
                         const std::vector<LightInEffect>& lights);

}  // namespace umbriel
