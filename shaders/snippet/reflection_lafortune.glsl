#include "snippet/environment.glsl"
#include "formula/lafortune.glsl"
#include "formula/lambert.glsl"
#include "snippet/material.glsl"

// A diffuse part and up to kMaxLobes cosine lobes. shaders/README.md says what a reflection_*.glsl defines.
#define LIT
#define Reflection LafortuneReflection

struct LafortuneReflection {
    vec3 diffuse;
    vec3 highlightShare;
};

LafortuneReflection reflectionOf(vec3 factor, vec3 texel) { return LafortuneReflection(factor * texel, vec3(1.0)); }

// Along the texture's u where there are tangents, as lobes whose x and y differ need; otherwise any.
vec3 lobeTangent(vec3 normal) {
    vec3 along = abs(normal.y) < 0.9 ? vec3(normal.z, 0.0, -normal.x) : vec3(0.0, -normal.z, normal.y);
#ifdef FEATURE_VERTEX_TANGENTS
    vec3 given = surface.tangent.xyz - normal * dot(surface.tangent.xyz, normal);
    return normalizeOr(given, normalizeOr(along, vec3(1.0, 0.0, 0.0)));
#else
    return normalizeOr(along, vec3(1.0, 0.0, 0.0));
#endif
}

vec3 reflectLight(LafortuneReflection reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    float cosLight = dot(normal, toLight);
    if (!(cosLight > 0.0)) return vec3(0.0);
    vec3 tangent = lobeTangent(normal);
    vec3 bitangent = cross(normal, tangent);
    vec3 toLightLocal = localFromFrame(toLight, tangent, bitangent, normal);
    vec3 toEyeLocal = localFromFrame(toEye, tangent, bitangent, normal);
    vec3 brdf = lambertBrdf(reflection.diffuse);
    for (int i = 0; i < kMaxLobes && material.lobes[2 * i + 1].w > 0.5; ++i) {
        LafortuneLobe lobe;
        lobe.albedo = material.lobes[2 * i].rgb * reflection.highlightShare;
        lobe.exponent = material.lobes[2 * i].w;
        lobe.axes = material.lobes[2 * i + 1].xyz;
        brdf += lafortuneLobe(lobe, toLightLocal, toEyeLocal);
    }
    return brdf * cosLight;
}

vec3 reflectAmbient(LafortuneReflection reflection, vec3 radiance, float occlusion) {
    return reflection.diffuse * radiance * occlusion;
}

LafortuneReflection withHighlight(LafortuneReflection reflection, vec3 share) {
    reflection.highlightShare = share;
    return reflection;
}

#ifdef FEATURE_ENVIRONMENT
// What lobes mirror of an even environment, seen along the normal: the integral of albedo (C_z cos)^n cos is
// albedo C_z^n 2 pi / (n + 2). The widest decides how blurred.
vec3 lobesSeenAlongTheNormal() {
    vec3 sum = vec3(0.0);
    for (int i = 0; i < kMaxLobes && material.lobes[2 * i + 1].w > 0.5; ++i) {
        LafortuneLobe lobe;
        lobe.albedo = material.lobes[2 * i].rgb;
        lobe.exponent = material.lobes[2 * i].w;
        lobe.axes = material.lobes[2 * i + 1].xyz;
        sum += lafortuneLobe(lobe, vec3(0.0, 0.0, 1.0), vec3(0.0, 0.0, 1.0)) * 2.0 * kPi / (lobe.exponent + 2.0);
    }
    return sum;
}

float lobesRoughness() {
    float roughness = 0.0;
    for (int i = 0; i < kMaxLobes && material.lobes[2 * i + 1].w > 0.5; ++i)
        roughness = max(roughness, roughnessFromExponent(material.lobes[2 * i].w));
    return roughness;
}

EnvironmentShare environmentShare(LafortuneReflection reflection) {
    return EnvironmentShare(reflection.diffuse,
                            reflection.highlightShare * lobesSeenAlongTheNormal(), lobesRoughness(), kEnvironmentPlain);
}
#endif
