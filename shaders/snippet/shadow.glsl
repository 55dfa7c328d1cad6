#include "structs/shadow.glsl"
#include "snippet/light_part.glsl"
#include "snippet/shadow_nearest.glsl"
#include "snippet/shadow_filter.glsl"

// Every module's share of a light that arrives, 1 lit, 0 in shadow, by functions of one signature:
//
//     float shadowFactor_MODULE(uint shadow, vec3 relative, vec3 normal, vec3 toLight)
//
// shadow: index of the light's first record, for shadowAt(); relative: the surface, eye-relative world; normal: geometric, unit; toLight:
// unit. A module is there when its feature is (server/shadow/shadow_module.h). docs/shadows.md says how to add one.
#ifdef FEATURE_SHADOWS
#ifdef FEATURE_SHADOW_VIEW
#ifndef VERTEX_STAGE
#include "snippet/shadow_view.glsl"
#endif

// shadow: the light's layer. Vertices have no place in the view's images, and none asks.
float shadowFactor(uint shadow, vec3 relative, vec3 normal, vec3 toLight) {
#ifdef VERTEX_STAGE
    return 1.0;
#else
    return shadowFactor_view(shadow);
#endif
}
#else
layout(binding = 6) uniform sampler2DArray shadowMaps;
layout(binding = 10) uniform sampler2DArray shadowBounds;  // stage/shadow_bounds.frag.glsl

// One map, plain or warped, filtered as the viewport wants it.
float shadowFactor_map(uint shadow, vec3 relative, vec3 normal, vec3 toLight) {
#ifdef READS_SHADOW_PLACE
    ShadowPlace place = placeOnParallelMap(shadowAt(shadow), passed.linear, passed.bias);
#else
    ShadowPlace place = placeOnShadowMap(shadowAt(shadow), relative, normal, toLight);
#endif
#if defined(FEATURE_SHADOW_SOFT_FILTER)
    return filterSoft(shadowMaps, shadowBounds, shadowAt(shadow), place);
#elif defined(FEATURE_SHADOW_FILTER)
    return filterPercentageCloser(shadowMaps, shadowBounds, shadowAt(shadow), place);
#else
    return filterNearest(shadowMaps, shadowAt(shadow), place);
#endif
}

#ifdef FEATURE_SHADOW_CUBE
float shadowFactor_cube(uint shadow, vec3 relative, vec3 normal, vec3 toLight) {
    return shadowFactor_map(shadow + cubeFaceOf(relative - shadowAt(shadow).origin), relative, normal, toLight);
}
#endif

#ifdef FEATURE_SHADOW_HEMISPHERES
float shadowFactor_hemispheres(uint shadow, vec3 relative, vec3 normal, vec3 toLight) {
    uint half_ = hemisphereOf(relative - shadowAt(shadow).origin, shadowAt(shadow).axisZ);
    return shadowFactor_map(shadow + half_, relative, normal, toLight);
}
#endif

bool isTurnedAway(vec3 normal, vec3 toLight) {
#ifdef READS_SHADOW_PLACE
    return gl_FrontFacing ? passed.cosine < 0.0 : passed.cosine > 0.0;
#else
    return dot(normal, toLight) < 0.0;
#endif
}

float shadowFactor_maps(uint shadow, vec3 relative, vec3 normal, vec3 toLight) {
    // What is turned away is in its own shadow, whoever else casts.
    if (isTurnedAway(normal, toLight)) return 0.0;
#ifdef FEATURE_SHADOW_CUBE
    if (shadowAt(shadow).shape == kShadowCube) return shadowFactor_cube(shadow, relative, normal, toLight);
#endif
#ifdef FEATURE_SHADOW_HEMISPHERES
    if (shadowAt(shadow).shape == kShadowHemisphere) return shadowFactor_hemispheres(shadow, relative, normal, toLight);
#endif
    return shadowFactor_map(shadow, relative, normal, toLight);
}

#ifndef VERTEX_STAGE
#include "snippet/shadow_light_map.glsl"
#endif

#ifdef FEATURE_SHADOW_MIXED
// Light that passes what the surface's light map knows, or without one a map of it, and what moves.
float shadowFactor_lightMap(uint shadow, vec3 relative, vec3 normal, vec3 toLight) {
    float factor = 1.0;
#if defined(FEATURE_SHADOW_LIGHT_MAP) && !defined(VERTEX_STAGE)
    factor = lightMapAt(shadow);
#endif
    if (shadowAt(shadow).besideMap == 0u) return factor;
    uint moving = shadow + shadowAt(shadow).besideMap;
#ifndef FEATURE_SHADOW_LIGHT_MAP
    uint parts = shadowAt(moving).shape == kShadowCube ? 6u : 1u;
    factor = shadowFactor_maps(moving + parts, relative, normal, toLight);
#endif
    return min(factor, shadowFactor_maps(moving, relative, normal, toLight));
}
#endif

float shadowFactor(uint shadow, vec3 relative, vec3 normal, vec3 toLight) {
#if !defined(FEATURE_SHADOW_LIGHT_MAP) || defined(FEATURE_SHADOW_MIXED)
#ifdef FEATURE_SHADOW_MIXED
    if (shadowAt(shadow).shape == kShadowLightMap) return shadowFactor_lightMap(shadow, relative, normal, toLight);
#endif
    return shadowFactor_maps(shadow, relative, normal, toLight);
#elif defined(VERTEX_STAGE)
    return 1.0;  // vertices have no place in the atlas, and none asks
#else
    return lightMapAt(shadow);  // no light has a map
#endif
}
#endif
#endif
