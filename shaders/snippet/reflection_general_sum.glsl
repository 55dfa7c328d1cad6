#include "snippet/environment.glsl"
#include "snippet/classic_material.glsl"

// The general sum (5.13). Its a_i and s_i are a light's ambientShare and highlightShare (light_sum.glsl).
// shaders/README.md says what a reflection_*.glsl defines.
#define LIT
#define Reflection ClassicMaterial

ClassicMaterial reflectionOf(vec3 factor, vec3 texel) { return classicMaterial(factor * texel); }

vec3 reflectLight(ClassicMaterial reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    return generalSumTerm(reflection, vec3(0.0), vec3(1.0), vec3(1.0), normal, toLight, toEye) * kInversePi;
}

vec3 reflectAmbient(ClassicMaterial reflection, vec3 radiance, float occlusion) {
    return classicAmbient(reflection, radiance, occlusion);
}

ClassicMaterial withHighlight(ClassicMaterial reflection, vec3 share) {
    reflection.specular *= share;
    return reflection;
}

#ifdef FEATURE_ENVIRONMENT
EnvironmentShare environmentShare(ClassicMaterial reflection) {
    return EnvironmentShare(reflection.diffuse, reflection.specular, roughnessFromExponent(reflection.shininess), kEnvironmentPlain);
}
#endif
