#include "snippet/light_sum.glsl"
#include "snippet/vertex_table.glsl"

// What the vertices found, with the shadows of the pixel.
#ifdef FEATURE_VERTEX_SHADING
#ifdef FEATURE_VERTEX_TABLE
vec3 interpolatedInTable(uvec3 at, vec3 shares) {
    return inTable(at.x) * shares.x + inTable(at.y) * shares.y + inTable(at.z) * shares.z;
}
#endif

vec3 interpolatedRadiance(vec3 faceNormal) {
#ifdef FEATURE_VERTEX_TABLE
    int side = 0;
#ifdef FEATURE_DOUBLE_SIDED
    if (!gl_FrontFacing) side = 1;
#endif
    uvec3 corners;
    vec3 shares;
    cornersOfTriangle(corners, shares);
    uvec3 at = uvec3(vertexRadianceAt(corners.x, side), vertexRadianceAt(corners.y, side),
                     vertexRadianceAt(corners.z, side));
    vec3 radiance = interpolatedInTable(at, shares);
#elif defined(FEATURE_DOUBLE_SIDED)
    vec3 radiance = gl_FrontFacing ? surface.radiance : surface.radianceBehind;
#else
    vec3 radiance = surface.radiance;
#endif
#ifdef FEATURE_SHADOWS
    int next = 0;
    for (uint i = 0u; i < lightCount(); ++i) {
        GpuLight light = lightAt(i);
        if (light.shadowIndex < 0) continue;
#ifdef FEATURE_VERTEX_TABLE
        at += 3u;
        vec3 contribution = interpolatedInTable(at, shares);
#else
        vec3 contribution = surface.shadowed[next];
#ifdef FEATURE_DOUBLE_SIDED
        if (!gl_FrontFacing) contribution = surface.shadowedBehind[next];
#endif
        ++next;
#endif
        // Where nothing arrives, no map needs to be asked.
        if (!any(greaterThan(contribution, vec3(0.0)))) continue;
        vec3 toLight;
        irradianceFrom(light, surface.relative, toLight);
        radiance += contribution * shadowTint(i, light, surface.relative, faceNormal, toLight);
    }
#endif
    return radiance;
}
#endif
