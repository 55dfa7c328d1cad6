#include "formula/attenuation.glsl"
#include "formula/light.glsl"
#include "snippet/photometric_web.glsl"
#include "snippet/passed_constants.glsl"
#include "structs/light_block.glsl"

#if defined(FEATURE_ONE_LIGHT)
#define LIGHT_COUNT 1u
#elif defined(FEATURE_TWO_LIGHTS)
#define LIGHT_COUNT 2u
#elif defined(FEATURE_THREE_LIGHTS)
#define LIGHT_COUNT 3u
#elif defined(FEATURE_FOUR_LIGHTS)
#define LIGHT_COUNT 4u
#endif

layout(location = 3) uniform vec3 ambientRadiance;  // of the ambient lights that reach this item
#ifdef READS_PASSED_CONSTANTS
#define AMBIENT_RADIANCE passed.ambientRadiance
#else
#define AMBIENT_RADIANCE ambientRadiance
#endif

// The lights that reach a draw item; positions are eye-relative world. lightAt(i) is the i-th of lightCount(), and
// firstShadowOf(i, light) its first record of shadowAt(), when it has any.
#ifdef READS_PASSED_CONSTANTS
// One parallel light.
uint lightCount() { return 1u; }
GpuLight lightAt(uint i) {
    GpuLight light;
    light.kind = kLightDirectional;
    light.direction = passed.direction;
    light.irradianceOrIntensity = passed.irradianceOrIntensity;
    light.ambientShare = passed.ambientShare;
    light.highlightShare = passed.highlightShare;
    light.shadowIndex = 0;
    light.index = passed.index;
    return light;
}
uint firstShadowOf(uint i, GpuLight light) { return 0u; }
#ifdef FEATURE_SHADOWS
// One map.
GpuShadow shadowAt(uint i) {
    GpuShadow shadow;
    shadow.clipFromRelative = passed.clipFromRelative;
    shadow.texelX = passed.texelX;
    shadow.texelY = passed.texelY;
    shadow.warpX = passed.warpX;
    shadow.warpY = passed.warpY;
    shadow.isPerspective = 0.0;
    shadow.mapSize = passed.mapSize;
    shadow.unwarp = passed.unwarp;
    shadow.layer = passed.layer;
    shadow.constantBias = passed.constantBias;
    shadow.normalOffset = passed.normalOffset;
    shadow.depthScale = passed.depthScale;
    shadow.depthOffset = passed.depthOffset;
    shadow.filterTexels = passed.filterTexels;
    shadow.filterMetres = passed.filterMetres;
    shadow.lightSize = passed.lightSize;
    shadow.maxTexels = passed.maxTexels;
    shadow.filterSamples = passed.filterSamples;
    shadow.blockerSamples = passed.blockerSamples;
    shadow.boundsBlock = passed.boundsBlock;
    shadow.texelRowX = passed.texelRowX;
    shadow.texelRowY = passed.texelRowY;
    shadow.depthAtEye = passed.depthAtEye;
    shadow.offsetX = passed.offsetX;
    shadow.offsetY = passed.offsetY;
    shadow.depthPerMetre = passed.depthPerMetre;
    return shadow;
}
#endif
#elif defined(LIGHT_COUNT)
layout(std140, binding = 2) uniform LightBlock { BlockLight blockLights[kBlockLights]; };
uint lightCount() { return LIGHT_COUNT; }
GpuLight lightAt(uint i) { return blockLights[i].light; }
uint firstShadowOf(uint i, GpuLight light) { return i * kBlockParts; }
#define shadowAt(i) blockLights[(i) / kBlockParts].shadows[(i) % kBlockParts]
#else
layout(std430, binding = 0) readonly buffer Lights { GpuLight lights[]; };
// A run of this list.
layout(std430, binding = 1) readonly buffer LightLists { uint lightList[]; };
layout(location = 2) uniform uvec2 lightRun;  // first, count
uint lightCount() { return lightRun.y; }
GpuLight lightAt(uint i) { return lights[lightList[lightRun.x + i]]; }
uint firstShadowOf(uint i, GpuLight light) { return uint(light.shadowIndex); }
#ifdef FEATURE_SHADOWS
layout(std430, binding = 2) readonly buffer Shadows { GpuShadow shadows[]; };
#define shadowAt(i) shadows[i]
#endif
#endif

#include "snippet/shadow.glsl"

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
#if !defined(FEATURE_POINT_LIGHTS) && !defined(FEATURE_SPOT_LIGHTS) && !defined(FEATURE_GONIOMETRIC_LIGHTS)
    toLight = -light.direction;
    return light.irradianceOrIntensity;
#else
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
#endif
}

// The one place where shadow meets light: the share of its own contribution that remains of the i-th light.
float shadowFactor(uint i, GpuLight light, vec3 relative, vec3 faceNormal, vec3 toLight) {
#ifdef FEATURE_SHADOWS
#ifdef FEATURE_SHADOW_VIEW
    uint shadow = light.darknessLayer;
#else
    uint shadow = firstShadowOf(i, light);
#endif
#ifndef FEATURE_ONE_LIGHT  // it has one: nobody else could
    if (light.shadowIndex >= 0)
#endif
        return shadowFactor(shadow, relative, faceNormal, toLight);
#endif
    return 1.0;
}
