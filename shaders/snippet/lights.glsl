#include "formula/light.glsl"
#include "snippet/shadow.glsl"
#include "structs/light.glsl"

// Positions are eye-relative world.
layout(std430, binding = 0) readonly buffer Lights { GpuLight lights[]; };
// Which lights reach a draw item: a run of this list.
layout(std430, binding = 1) readonly buffer LightLists { uint lightList[]; };
layout(location = 2) uniform uvec2 lightRun;  // first, count

// What arrives from a light on a surface that faces it, W/m^2, unshadowed; and the unit vector towards it.
vec3 irradianceFrom(GpuLight light, vec3 relative, out vec3 toLight) {
#ifdef FEATURE_DIRECTIONAL_LIGHTS
    if (light.kind == kLightDirectional) {
        toLight = -light.direction;
        return light.irradianceOrIntensity;
    }
#endif
    float distanceSquared;
    toLight = directionTo(light.position, relative, distanceSquared);
    float share = inverseSquare(distanceSquared) * rangeWindow(distanceSquared, light.range);
#ifdef FEATURE_SPOT_LIGHTS
    if (light.kind == kLightSpot) share *= spotFactor(dot(-toLight, light.direction), light.spotCosOuter, light.spotScale);
#endif
    return light.irradianceOrIntensity * share;
}

// The one place where shadow meets light: the share of this light's own contribution that remains.
float shadowFactor(GpuLight light, vec3 relative, vec3 faceNormal, vec3 toLight) {
#ifdef FEATURE_SHADOWS
    if (light.shadowIndex >= 0)
        return shadowFactor(uint(light.shadowIndex), relative, faceNormal, toLight);
#endif
    return 1.0;
}
