#include "snippet/light_sum.glsl"

// What the vertices found, with the shadows of the pixel.
#ifdef FEATURE_VERTEX_SHADING
vec3 interpolatedRadiance(vec3 faceNormal) {
#ifdef FEATURE_DOUBLE_SIDED
    vec3 radiance = gl_FrontFacing ? surface.radiance : surface.radianceBehind;
#else
    vec3 radiance = surface.radiance;
#endif
#ifdef FEATURE_SHADOWS
    int next = 0;
    for (uint i = 0u; i < lightCount() && next < kShadowedLights; ++i) {
        GpuLight light = lightAt(i);
        if (light.shadowIndex < 0) continue;
        vec3 contribution = surface.shadowed[next];
#ifdef FEATURE_DOUBLE_SIDED
        if (!gl_FrontFacing) contribution = surface.shadowedBehind[next];
#endif
        ++next;
        vec3 toLight;
        irradianceFrom(light, surface.relative, toLight);
        radiance += contribution * shadowTint(i, light, surface.relative, faceNormal, toLight);
    }
#endif
    return radiance;
}
#endif
