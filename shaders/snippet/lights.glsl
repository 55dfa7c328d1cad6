#include "formula/attenuation.glsl"
#include "formula/light.glsl"
#include "snippet/photometric_web.glsl"
#include "snippet/shadow.glsl"
#include "structs/light.glsl"

// Positions are eye-relative world.
layout(std430, binding = 0) readonly buffer Lights { GpuLight lights[]; };
// Which lights reach a draw item: a run of this list.
layout(std430, binding = 1) readonly buffer LightLists { uint lightList[]; };
layout(location = 2) uniform uvec2 lightRun;  // first, count

// The share that is left of a light after `meters`.
float fadeOf(GpuLight light, float meters, float distanceSquared) {
#ifdef FEATURE_ARTIST_ATTENUATION
    if (light.fade == kFadePolynomial) return artistAttenuation(meters, light.attenuation);
#endif
    return inverseSquare(distanceSquared);
}

// The share that a spot sends into a direction, times what is left of it there.
float spotShare(GpuLight light, vec3 fromLight, float meters, float distanceSquared) {
#ifdef FEATURE_SPOT_EXPONENTS
    if (light.spotForm == kSpotProduct)
        return spotClampedProduct(fromLight, light.direction, light.spotExponent, meters, light.attenuation);
    if (light.spotForm == kSpotCone)
        return spotCone(fromLight, light.direction, light.spotCosOuter, light.spotExponent) *
               fadeOf(light, meters, distanceSquared);
#endif
    return spotFactor(dot(fromLight, light.direction), light.spotCosOuter, light.spotScale) *
           fadeOf(light, meters, distanceSquared);
}

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
#if defined(FEATURE_ARTIST_ATTENUATION) || defined(FEATURE_SPOT_EXPONENTS)
    float meters = lengthOf(light.position - relative);
#else
    float meters = 0.0;  // nobody asks
#endif
    float share = rangeWindow(distanceSquared, light.range);
#ifdef FEATURE_SPOT_LIGHTS
    if (light.kind == kLightSpot)
        return light.irradianceOrIntensity * (share * spotShare(light, -toLight, meters, distanceSquared));
#endif
    share *= fadeOf(light, meters, distanceSquared);
#ifdef FEATURE_GONIOMETRIC_LIGHTS
    if (light.kind == kLightGoniometric) share *= webShare(light, -toLight);
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
