#include "formula/metallic_roughness.glsl"
#include "formula/normal_map.glsl"
#include "snippet/material.glsl"

// What the maps of a material do to a place before it is lit: to a pixel or, in the vertex stage, to a vertex.

// side: 1 for the front, -1 for the back; `normal` is unit and turned to that side already.
vec3 normalThroughMap(vec3 normal, float side) {
#if defined(FEATURE_NORMAL_TEXTURE) && defined(FEATURE_VERTEX_TANGENTS)
    vec3 mapped = normalFromTexel(SAMPLE(normalTexture, 2).xyz, MATERIAL.metallicRoughness.z);
    // Seen from behind, the tangent plane turns round with the normal (glTF 2.0, 3.9.4).
    return mappedNormal(normal, surface.tangent.xyz * side, surface.tangent.w * side, mapped, normal);
#else
    return normal;
#endif
}

float occlusionThroughMap() {
#ifdef FEATURE_OCCLUSION_TEXTURE
    return occlusionFactor(SAMPLE(occlusionTexture, 3).r, MATERIAL.metallicRoughness.w);
#else
    return 1.0;
#endif
}
