#include "snippet/frame.glsl"
#define VARYING in
#include "snippet/surface_varyings.glsl"
#include "snippet/surface_colour.glsl"
#include "snippet/surface_frame.glsl"
#include REFLECTION_MODEL
#include "snippet/light_sum.glsl"
#include "snippet/interpolated_shading.glsl"
#include "snippet/fog.glsl"
#include "snippet/surface_maps.glsl"
#include "snippet/held_colour.glsl"

layout(location = 0) out vec4 colourOut;  // associated alpha

vec3 shadingNormal(vec3 faceNormal, float side) {
#ifdef FEATURE_VERTEX_NORMALS
    vec3 normal = normalizeOr(surface.normal, faceNormal * side) * side;
#else
    vec3 normal = faceNormal;
#endif
    return normalThroughMap(normal, side);
}

#ifdef LIT
#ifdef READS_MATT_LIGHT
// Between the normal on the front and the way to the light.
float mattCosine() {
#if !defined(FEATURE_VERTEX_NORMALS) && defined(FEATURE_FIRST_VERTEX_NORMALS)
    return passed.cosine;
#elif !defined(FEATURE_VERTEX_NORMALS)
    return dot(faceNormalWorld(), -passed.direction);
#else
    float squared = dot(passed.normalToLight, passed.normalToLight);
#ifdef FEATURE_FIRST_VERTEX_NORMALS
    float ofFace = passed.cosine;
#else
    float ofFace = -passed.direction.z;
#endif
    return squared > 1e-30 ? passed.normalToLight.z / sqrt(squared) : ofFace;
#endif
}

void addMattLight(vec3 texel, float side, vec3 faceNormal, inout vec3 radiance) {
    float cosine = mattCosine() * side;
    // Where nothing arrives, no map needs to be asked.
    if (cosine > 0.0)
        radiance += passed.matt * texel * cosine *
                    shadowTint(0u, lightAt(0u), surface.relative, faceNormal, -passed.direction);
}
#elif defined(ANY_LIGHTS) && !defined(FEATURE_VERTEX_SHADING)
void addLight(uint i, Reflection reflection, vec3 place, vec3 normal, vec3 toEye, vec3 faceNormal,
              inout vec3 radiance) {
    GpuLight light = lightAt(i);
    vec3 toLight;
    vec3 contribution = lightTerm(light, reflection, place, normal, toEye, toLight, radiance);
    // Where nothing arrives, no map needs to be asked.
    if (any(greaterThan(contribution, vec3(0.0))))
        radiance += contribution * shadowTint(i, light, surface.relative, faceNormal, toLight);
}
#endif

vec3 reflectedRadiance(vec3 factor, vec3 texel) {
    float side = gl_FrontFacing ? 1.0 : -1.0;
#if defined(FEATURE_SHADOWS) || !defined(FEATURE_VERTEX_NORMALS)
    vec3 faceNormal = faceNormalWorld() * side;
#else
    vec3 faceNormal = vec3(0.0, 0.0, 1.0);
#endif
#ifdef FEATURE_VERTEX_SHADING
    return interpolatedRadiance(faceNormal) * texel;
#else
    vec3 place = surface.relative;
#ifdef FEATURE_FLAT_MEAN
    vec3 normal;
    flatFace(place, normal);
    normal *= side;
#else
    vec3 normal = shadingNormal(faceNormal, side);
#endif
    vec3 toEye = directionToEye(place);
    float occlusion = occlusionThroughMap();
    Reflection reflection = reflectionOf(factor, texel);
    vec3 radiance = ambientSum(reflection, occlusion);
#ifdef FEATURE_ENVIRONMENT
    radiance += environmentSum(environmentShare(reflection), normal, toEye, occlusion);
#endif
#if defined(READS_MATT_LIGHT)
    addMattLight(texel, side, faceNormal, radiance);
#elif defined(ANY_LIGHTS)
#ifdef LIGHT_COUNT
    // Not a loop: every place in the block is a constant, whether or not a compiler unrolls.
    addLight(0u, reflection, place, normal, toEye, faceNormal, radiance);
#if !defined(FEATURE_ONE_LIGHT)
    addLight(1u, reflection, place, normal, toEye, faceNormal, radiance);
#if !defined(FEATURE_TWO_LIGHTS)
    addLight(2u, reflection, place, normal, toEye, faceNormal, radiance);
#if !defined(FEATURE_THREE_LIGHTS)
    addLight(3u, reflection, place, normal, toEye, faceNormal, radiance);
#endif
#endif
#endif
#else
    for (uint i = 0u; i < lightCount(); ++i)
        addLight(i, reflection, place, normal, toEye, faceNormal, radiance);
#endif
#endif
    return radiance;
#endif
}
#endif

void main() {
    vec4 factor = baseFactor();
    vec4 texel = baseTexel();
    vec4 base = factor * texel;
#ifdef LIT
    vec3 radiance = emittedRadiance() + reflectedRadiance(factor.rgb, texel.rgb);
#else
    vec3 radiance = base.rgb;
#ifdef FEATURE_FOREIGN_SHADING
    radiance *= sharedTint(surface.relative, faceNormalWorld() * (gl_FrontFacing ? 1.0 : -1.0));
#endif
#endif
    radiance = heldColour(throughFog(radiance, surface.relative));

#if defined(FEATURE_ALPHA_BLEND)
    colourOut = vec4(radiance * base.a, base.a);
#else
    colourOut = vec4(radiance, 1.0);
#endif
#ifdef FEATURE_ALPHA_MASK
    // Last, so that every texture above had its neighbours for the choice of mip.
    if (base.a < MATERIAL.emission.w) discard;
#endif
}
