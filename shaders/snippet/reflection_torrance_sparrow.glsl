#include "snippet/environment.glsl"
#include "formula/torrance_sparrow.glsl"
#include "snippet/metallic_roughness_material.glsl"

// GGX microfacets over a coupled diffuse base. shaders/README.md says what a reflection_*.glsl defines.
#define LIT
#define Reflection TorranceSparrow

TorranceSparrow reflectionOf(vec3 factor, vec3 texel) {
    return torranceSparrowFrom(metallicRoughnessMaterial(factor * texel));
}

vec3 reflectLight(TorranceSparrow reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    return torranceSparrowReflect(reflection, normal, toLight, toEye);
}

vec3 reflectAmbient(TorranceSparrow reflection, vec3 radiance, float occlusion) {
    return (reflection.reflectance + (vec3(1.0) - reflection.reflectance) * reflection.diffuse) * radiance * occlusion;
}

TorranceSparrow withHighlight(TorranceSparrow reflection, vec3 share) {
    reflection.reflectance *= share;
    return reflection;
}

#ifdef FEATURE_ENVIRONMENT
EnvironmentShare environmentShare(TorranceSparrow reflection) {
    return EnvironmentShare(reflection.diffuse, reflection.reflectance, reflection.roughness, kEnvironmentCoupled);
}
#endif
