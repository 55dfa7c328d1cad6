#include "snippet/frame.glsl"
#define VARYING in
#include "snippet/surface_varyings.glsl"
#include "snippet/material.glsl"
#include "snippet/surface_frame.glsl"
#include "snippet/lights.glsl"
#include "formula/metallic_roughness.glsl"
#include "formula/blinn_phong.glsl"
#include "formula/normal_map.glsl"

layout(location = 3) uniform vec3 ambientRadiance;  // of the ambient lights that reach this item

layout(location = 0) out vec4 colourOut;  // associated alpha

vec3 shadingNormal(vec3 faceNormal, float side) {
#ifdef FEATURE_VERTEX_NORMALS
    vec3 normal = normalizeOr(surface.normal, faceNormal * side) * side;
#else
    vec3 normal = faceNormal;
#endif
#if defined(FEATURE_NORMAL_TEXTURE) && defined(FEATURE_VERTEX_TANGENTS)
    vec3 mapped = normalFromTexel(SAMPLE(normalTexture, 2).xyz, material.metallicRoughness.z);
    // Seen from behind, the tangent plane turns round with the normal (glTF 2.0, 3.9.4).
    normal = mappedNormal(normal, surface.tangent.xyz * side, surface.tangent.w * side, mapped, normal);
#endif
    return normal;
}

void main() {
    vec4 base = material.baseColour;
#ifdef FEATURE_VERTEX_COLOURS
    base *= surface.colour;
#endif
#ifdef FEATURE_BASE_COLOUR_TEXTURE
    base *= SAMPLE(baseColourTexture, 0);
#endif
    vec3 radiance = material.emission.rgb;
#ifdef FEATURE_EMISSION_TEXTURE
    radiance *= SAMPLE(emissionTexture, 4).rgb;
#endif

#if !defined(FEATURE_METALLIC_ROUGHNESS) && !defined(FEATURE_BLINN_PHONG)
    radiance = base.rgb;
#else
#if defined(FEATURE_SHADOWS) || !defined(FEATURE_VERTEX_NORMALS)
    float side = gl_FrontFacing ? 1.0 : -1.0;
    vec3 faceNormal = faceNormalWorld() * side;
#else
    float side = gl_FrontFacing ? 1.0 : -1.0;
    vec3 faceNormal = vec3(0.0, 0.0, 1.0);
#endif
    vec3 normal = shadingNormal(faceNormal, side);
    vec3 toEye = directionToEye();
    float occlusion = 1.0;
#ifdef FEATURE_OCCLUSION_TEXTURE
    occlusion = occlusionFactor(SAMPLE(occlusionTexture, 3).r, material.metallicRoughness.w);
#endif
#ifdef FEATURE_METALLIC_ROUGHNESS
    MetallicRoughness reflection;
    reflection.baseColour = base.rgb;
    reflection.metallic = material.metallicRoughness.x;
    reflection.roughness = material.metallicRoughness.y;
#ifdef FEATURE_METALLIC_ROUGHNESS_TEXTURE
    vec4 texel = SAMPLE(metallicRoughnessTexture, 1);
    reflection.metallic *= texel.b;
    reflection.roughness *= texel.g;
#endif
#ifdef FEATURE_AMBIENT_LIGHTS
    radiance += metallicRoughnessAmbient(reflection, ambientRadiance, occlusion);
#endif
#else
    BlinnPhong reflection;
    reflection.diffuse = base.rgb;
    reflection.specular = material.specular.rgb;
    reflection.shininess = material.specular.w;
#ifdef FEATURE_SPECULAR_TEXTURE
    reflection.specular *= SAMPLE(specularTexture, 5).rgb;
#endif
#ifdef FEATURE_AMBIENT_LIGHTS
    radiance += blinnPhongAmbient(material.ambient.rgb, ambientRadiance, occlusion);
#endif
#endif
#if defined(FEATURE_DIRECTIONAL_LIGHTS) || defined(FEATURE_POINT_LIGHTS) || defined(FEATURE_SPOT_LIGHTS)
    for (uint i = 0u; i < lightRun.y; ++i) {
        GpuLight light = lights[lightList[lightRun.x + i]];
        vec3 toLight;
        vec3 irradiance = irradianceFrom(light, surface.relative, toLight);
#ifdef FEATURE_METALLIC_ROUGHNESS
        vec3 reflected = metallicRoughnessReflect(reflection, normal, toLight, toEye);
#else
        vec3 reflected = blinnPhongReflect(reflection, normal, toLight, toEye);
#endif
        vec3 contribution = reflected * irradiance;
        // Where nothing arrives, no map needs to be asked.
        if (any(greaterThan(contribution, vec3(0.0)))) {
            float factor = shadowFactor(light, surface.relative, faceNormal, toLight);
            radiance += contribution * mix(frame.shadowColour.rgb, vec3(1.0), factor);
        }
    }
#endif
#endif

#if defined(FEATURE_ALPHA_BLEND)
    colourOut = vec4(radiance * base.a, base.a);
#else
    colourOut = vec4(radiance, 1.0);
#endif
#ifdef FEATURE_ALPHA_MASK
    // Last, so that every texture above had its neighbours for the choice of mip.
    if (base.a < material.emission.w) discard;
#endif
}
