#include "snippet/environment.glsl"
#include "snippet/classic_material.glsl"

// Schlick's substitute for the power, of the half vector. shaders/README.md says what a reflection_*.glsl defines.
#define LIT
#define Reflection ClassicMaterial

ClassicMaterial reflectionOf(vec3 factor, vec3 texel) { return classicMaterial(factor * texel); }

vec3 reflectLight(ClassicMaterial reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    return classicSum(reflection, normal, toLight, schlickHighlight(normal, toLight, toEye, reflection.shininess));
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
