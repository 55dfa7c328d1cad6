#include "formula/metallic_roughness.glsl"
#include "snippet/material.glsl"

// glTF's material. shaders/README.md says what a reflection_*.glsl defines.
#define LIT
#define Reflection MetallicRoughness

MetallicRoughness reflectionOf(vec3 factor, vec3 texel) {
    MetallicRoughness reflection;
    reflection.baseColour = factor * texel;
    reflection.metallic = material.metallicRoughness.x;
    reflection.roughness = material.metallicRoughness.y;
#ifdef FEATURE_METALLIC_ROUGHNESS_TEXTURE
    vec4 mapped = SAMPLE(metallicRoughnessTexture, 1);
    reflection.metallic *= mapped.b;
    reflection.roughness *= mapped.g;
#endif
    return reflection;
}

vec3 reflectLight(MetallicRoughness reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    return metallicRoughnessReflect(reflection, normal, toLight, toEye);
}

vec3 reflectAmbient(MetallicRoughness reflection, vec3 radiance, float occlusion) {
    return metallicRoughnessAmbient(reflection, radiance, occlusion);
}
