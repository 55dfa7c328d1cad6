#include "snippet/environment.glsl"
#include "formula/lambert.glsl"
#include "formula/phong.glsl"
#include "snippet/material.glsl"

// Ganster's k_d / pi and k_s cos^m / cos: not reciprocal, does not conserve energy. shaders/README.md says what a reflection_*.glsl defines.
#define LIT
#define Reflection PhongReflection

struct PhongReflection {
    vec3 diffuse;
    vec3 specular;
    float shininess;
};

PhongReflection reflectionOf(vec3 factor, vec3 texel) {
    return PhongReflection(factor * texel, specularColour(), material.specular.w);
}

vec3 reflectLight(PhongReflection reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    return lambertBrdf(reflection.diffuse) * max(dot(normal, toLight), 0.0) +
           nonReciprocalPhongReflect(reflection.specular, reflection.shininess, normal, toLight, toEye);
}

vec3 reflectAmbient(PhongReflection reflection, vec3 radiance, float occlusion) {
    return reflection.diffuse * radiance * occlusion;
}

PhongReflection withHighlight(PhongReflection reflection, vec3 share) {
    reflection.specular *= share;
    return reflection;
}

#ifdef FEATURE_ENVIRONMENT
EnvironmentShare environmentShare(PhongReflection reflection) {
    return EnvironmentShare(reflection.diffuse, reflection.specular, roughnessFromExponent(reflection.shininess), kEnvironmentPlain);
}
#endif
