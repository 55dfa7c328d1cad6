#include "snippet/lights.glsl"

// What reaches the eye from all the lights of a draw item, at a place: the part that is the same for every model.

#if defined(FEATURE_DIRECTIONAL_LIGHTS) || defined(FEATURE_POINT_LIGHTS) || defined(FEATURE_SPOT_LIGHTS) || \
    defined(FEATURE_GONIOMETRIC_LIGHTS)
#define ANY_LIGHTS
#endif

#ifdef LIT
vec3 ambientSum(Reflection reflection, float occlusion) {
#ifdef FEATURE_AMBIENT_LIGHTS
    return reflectAmbient(reflection, AMBIENT_RADIANCE, occlusion);
#else
    return vec3(0.0);
#endif
}

// What one light adds, as far as its shadow can take it away; what no shadow can is added to `unshadowed`.
vec3 lightTerm(GpuLight light, Reflection reflection, vec3 relative, vec3 normal, vec3 toEye, out vec3 toLight,
               inout vec3 unshadowed) {
    vec3 irradiance = irradianceFrom(light, relative, toLight);
#ifdef FEATURE_LIGHT_AMBIENT
    unshadowed += reflectAmbient(reflection, light.ambientShare * irradiance * kInversePi, 1.0);
#endif
#ifdef REFLECTS_UNSHADOWED
    unshadowed += reflectUnshadowed(reflection) * irradiance;
#endif
#ifdef FEATURE_LIGHT_HIGHLIGHTS
    reflection = withHighlight(reflection, light.highlightShare);
#endif
    return reflectLight(reflection, normal, toLight, toEye) * irradiance;
}
#endif

// The share of the i-th light's contribution that its shadow leaves.
vec3 shadowTint(uint i, GpuLight light, vec3 relative, vec3 faceNormal, vec3 toLight) {
    float factor = shadowFactor(i, light, relative, faceNormal, toLight);
#ifdef FEATURE_SHADOW_COLOUR
    return mix(frame.shadowColour.rgb, vec3(1.0), factor);
#else
    return vec3(factor);
#endif
}

#ifdef FEATURE_FOREIGN_SHADING
// For colours that light is in already, nobody knows how: the share that shadows leave of all the light on a matt surface.
vec3 sharedTint(vec3 relative, vec3 faceNormal) {
    vec3 all = vec3(0.0);
#ifdef FEATURE_AMBIENT_LIGHTS
    all = AMBIENT_RADIANCE / kInversePi;
#endif
    vec3 left = all;
    for (uint i = 0u; i < lightCount(); ++i) {
        GpuLight light = lightAt(i);
        vec3 toLight;
        vec3 irradiance = irradianceFrom(light, relative, toLight);
        irradiance *= max(dot(faceNormal, toLight), 0.0);
        all += irradiance;
        left += irradiance * shadowTint(i, light, relative, faceNormal, toLight);
    }
    return vec3(all.r > 0.0 ? left.r / all.r : 1.0, all.g > 0.0 ? left.g / all.g : 1.0,
                all.b > 0.0 ? left.b / all.b : 1.0);
}
#endif
