#include "snippet/surface_colour.glsl"
#include "snippet/surface_maps.glsl"
#include "snippet/to_eye.glsl"
#include REFLECTION_MODEL
#include "snippet/light_sum.glsl"
#include "snippet/vertex_table.glsl"

// Gouraud's and flat shading: the sum over the lights at a vertex, for its texel 1. Lights with a shadow stay apart, as
// shadows are looked up in the pixel. Every input is the same on every tile, so the vertex has one colour on all.

// What the pixels are to know of the front (0) or the back (1): the sum that no shadow dims.
void keepRadiance(int side, vec3 radiance) {
#ifdef FEATURE_VERTEX_TABLE
    storeInTable(vertexRadianceAt(uint(gl_VertexID), side), radiance);
#else
#ifdef FEATURE_DOUBLE_SIDED
    if (side == 1)
        surface.radianceBehind = radiance;
    else
#endif
        surface.radiance = radiance;
#endif
}

// And what the `next` of the lights with a shadow adds, before its shadow.
void keepShadowed(int side, int next, vec3 term) {
#ifdef FEATURE_SHADOWS
#ifdef FEATURE_VERTEX_TABLE
    storeInTable(vertexTermAt(uint(gl_VertexID), side, next), term);
#else
#ifdef FEATURE_DOUBLE_SIDED
    if (side == 1)
        surface.shadowedBehind[next] = term;
    else
#endif
        surface.shadowed[next] = term;
#endif
#endif
}

void shadeSide(int side, Reflection reflection, vec3 normal) {
    vec3 toEye = directionToEye(surface.relative);
    float occlusion = occlusionThroughMap();
    vec3 radiance = ambientSum(reflection, occlusion);
#ifdef FEATURE_ENVIRONMENT
    radiance += environmentSum(environmentShare(reflection), normal, toEye, occlusion);
#endif
#ifdef ANY_LIGHTS
    int next = 0;
    for (uint i = 0u; i < lightCount(); ++i) {
        GpuLight light = lightAt(i);
        vec3 toLight;
        vec3 term = lightTerm(light, reflection, surface.relative, normal, toEye, toLight, radiance);
        if (light.shadowIndex >= 0)
            keepShadowed(side, next++, term);
        else
            radiance += term;
    }
#endif
    keepRadiance(side, radiance);
}

void shadeVertex() {
#ifdef FEATURE_VERTEX_TABLE
    storeInTable(vertexPlaceAt(uint(gl_VertexID)), surface.relative);
#elif defined(FEATURE_SHADOWS)
    for (int i = 0; i < kShadowedLights; ++i) {
        keepShadowed(0, i, vec3(0.0));
        keepShadowed(1, i, vec3(0.0));
    }
#endif
    Reflection reflection = reflectionOf(baseFactor().rgb, vec3(1.0));
    // A vertex without a normal is lit as if it faced the eye: which triangle it is of, it does not know.
    vec3 normal = normalizeOr(surface.normal, directionToEye(surface.relative));
    shadeSide(0, reflection, normalThroughMap(normal, 1.0));
#ifdef FEATURE_DOUBLE_SIDED
    shadeSide(1, reflection, normalThroughMap(-normal, -1.0));
#endif
}
