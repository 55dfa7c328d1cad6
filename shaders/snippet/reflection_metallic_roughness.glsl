#include "snippet/environment.glsl"
#include "snippet/metallic_roughness_material.glsl"

// glTF's material. shaders/README.md says what a reflection_*.glsl defines.
#define LIT
#define Reflection MetallicRoughness

MetallicRoughness reflectionOf(vec3 factor, vec3 texel) { return metallicRoughnessMaterial(factor * texel); }

vec3 reflectLight(MetallicRoughness reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    return metallicRoughnessReflect(reflection, normal, toLight, toEye);
}

vec3 reflectAmbient(MetallicRoughness reflection, vec3 radiance, float occlusion) {
    return metallicRoughnessAmbient(reflection, radiance, occlusion);
}

MetallicRoughness withHighlight(MetallicRoughness reflection, vec3 share) { return reflection; }

#ifdef FEATURE_ENVIRONMENT
EnvironmentShare environmentShare(MetallicRoughness reflection) {
    return EnvironmentShare(diffuseAlbedo(reflection), reflectanceAtNormal(reflection), reflection.roughness,
                            kEnvironmentMicrofacets);
}
#endif
