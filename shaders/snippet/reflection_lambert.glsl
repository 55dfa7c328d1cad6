#include "snippet/environment.glsl"
#include "formula/lambert.glsl"

// An ideal diffuse surface (5.7). shaders/README.md says what a reflection_*.glsl defines.
#define LIT
#define Reflection LambertReflection

struct LambertReflection {
    vec3 albedo;
};

LambertReflection reflectionOf(vec3 factor, vec3 texel) { return LambertReflection(factor * texel); }

vec3 reflectLight(LambertReflection reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    return lambertBrdf(reflection.albedo) * max(dot(normal, toLight), 0.0);
}

vec3 reflectAmbient(LambertReflection reflection, vec3 radiance, float occlusion) {
    return reflection.albedo * radiance * occlusion;
}

LambertReflection withHighlight(LambertReflection reflection, vec3 share) { return reflection; }

#ifdef FEATURE_ENVIRONMENT
EnvironmentShare environmentShare(LambertReflection reflection) {
    return EnvironmentShare(reflection.albedo, vec3(0.0), 1.0, kEnvironmentPlain);
}
#endif
