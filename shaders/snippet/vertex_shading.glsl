#include "snippet/surface_colour.glsl"
#include "snippet/to_eye.glsl"
#include REFLECTION_MODEL
#include "snippet/light_sum.glsl"

// Gouraud's and flat shading: the sum over the lights at a vertex, for its texel 1. Lights with a shadow stay apart, as
// shadows are looked up in the pixel. Every input is the same on every tile, so the vertex has one colour on all.

vec3 shadedSide(Reflection reflection, vec3 normal, out vec3 shadowed[kShadowedLights]) {
    for (int i = 0; i < kShadowedLights; ++i) shadowed[i] = vec3(0.0);
    vec3 toEye = directionToEye(surface.relative);
    vec3 radiance = ambientSum(reflection, 1.0);
#ifdef FEATURE_ENVIRONMENT
    radiance += environmentSum(environmentShare(reflection), normal, toEye, 1.0);
#endif
#ifdef ANY_LIGHTS
    int next = 0;
    for (uint i = 0u; i < lightCount(); ++i) {
        GpuLight light = lightAt(i);
        vec3 toLight;
        vec3 term = lightTerm(light, reflection, surface.relative, normal, toEye, toLight, radiance);
        if (light.shadowIndex >= 0 && next < kShadowedLights)
            shadowed[next++] = term;
        else
            radiance += term;
    }
#endif
    return radiance;
}

void shadeVertex() {
    Reflection reflection = reflectionOf(baseFactor().rgb, vec3(1.0));
    // A vertex without a normal is lit as if it faced the eye: which triangle it is of, it does not know.
    vec3 normal = normalizeOr(surface.normal, directionToEye(surface.relative));
    vec3 shadowed[kShadowedLights];
    surface.radiance = shadedSide(reflection, normal, shadowed);
#ifdef FEATURE_SHADOWS
    for (int i = 0; i < kShadowedLights; ++i) surface.shadowed[i] = shadowed[i];
#endif
#ifdef FEATURE_DOUBLE_SIDED
    surface.radianceBehind = shadedSide(reflection, -normal, shadowed);
#ifdef FEATURE_SHADOWS
    for (int i = 0; i < kShadowedLights; ++i) surface.shadowedBehind[i] = shadowed[i];
#endif
#endif
}
