#include "structs/shadow.glsl"
#include "snippet/shadow_nearest.glsl"

// Every module's share of a light that arrives, 1 lit, 0 in shadow, by functions of one signature:
//
//     float shadowFactor_MODULE(uint shadow, vec3 relative, vec3 normal, vec3 toLight)
//
// shadow: index of the light's first record; relative: the surface, eye-relative world; normal: geometric, unit; toLight:
// unit. A module is there when its feature is (server/shadow/shadow_module.h). docs/shadows.md says how to add one.
#ifdef FEATURE_SHADOWS
layout(std430, binding = 2) readonly buffer Shadows { GpuShadow shadows[]; };
layout(binding = 6) uniform sampler2DArray shadowMaps;

#define SHADOW_FILTER filterNearest

float shadowFactor_map(uint shadow, vec3 relative, vec3 normal, vec3 toLight) {
    return SHADOW_FILTER(shadowMaps, shadows[shadow], relative, normal, toLight);
}

float shadowFactor(uint shadow, vec3 relative, vec3 normal, vec3 toLight) {
    return shadowFactor_map(shadow, relative, normal, toLight);
}
#endif
