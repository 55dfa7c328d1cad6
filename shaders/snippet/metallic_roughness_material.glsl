#include "formula/metallic_roughness.glsl"
#include "snippet/material.glsl"

MetallicRoughness metallicRoughnessMaterial(vec3 baseColour) {
    MetallicRoughness reflection;
    reflection.baseColour = baseColour;
    reflection.metallic = MATERIAL.metallicRoughness.x;
    reflection.roughness = MATERIAL.metallicRoughness.y;
#ifdef FEATURE_METALLIC_ROUGHNESS_TEXTURE
    vec4 mapped = SAMPLE(metallicRoughnessTexture, 1);
    reflection.metallic *= mapped.b;
    reflection.roughness *= mapped.g;
#endif
    return reflection;
}
