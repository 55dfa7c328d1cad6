#include "formula/environment.glsl"
#include "formula/phong.glsl"

// What a surface reflects of the environment: the mirror direction in a map filtered for its roughness, and the
// convolved map in the direction of its normal (Ganster 1.2.2), weighted by what its reflection model says.

// How a model divides an environment; reflection_*.glsl say environmentShare() of theirs.
struct EnvironmentShare {
    vec3 diffuse;
    vec3 specular;    // of microfacets: reflectance at normal incidence
    float roughness;  // perceptual, of the lobe
    int coupling;     // kEnvironment...
};
const int kEnvironmentPlain = 0;        // k_s and k_d as they are
const int kEnvironmentMicrofacets = 1;  // Fresnel's share is mirrored, and at each facet taken from the diffuse part
const int kEnvironmentCoupled = 2;      // what is mirrored is taken from the diffuse part

#ifdef FEATURE_ENVIRONMENT
layout(binding = 12) uniform samplerCube environmentRadiance;
layout(binding = 13) uniform samplerCube environmentConvolved;
layout(binding = 14) uniform sampler2D environmentShares;
layout(location = 12) uniform mat3 environmentFromWorld;
layout(location = 13) uniform vec4 environmentScale;  // rgb; w: the level of the largest roughness

vec3 environmentSum(EnvironmentShare share, vec3 normal, vec3 toEye, float occlusion) {
    vec3 shares = textureLod(environmentShares, vec2(max(dot(normal, toEye), 0.0), share.roughness), 0.0).xyz;
    vec3 specular = share.specular;
    vec3 diffuse = share.diffuse;
    if (share.coupling != kEnvironmentPlain) specular = environmentMirrored(share.specular, shares.x, shares.y);
    if (share.coupling == kEnvironmentMicrofacets) diffuse *= environmentUnmirrored(share.specular, shares.z);
    if (share.coupling == kEnvironmentCoupled) diffuse *= vec3(1.0) - specular;
    vec3 mirrored = textureLod(environmentRadiance, environmentFromWorld * mirrorDirection(normal, toEye),
                               share.roughness * environmentScale.w).rgb;
    vec3 convolved = textureLod(environmentConvolved, environmentFromWorld * normal, 0.0).rgb;
    return environmentReflect(specular, diffuse, mirrored, convolved) * environmentScale.rgb * occlusion;
}
#endif
