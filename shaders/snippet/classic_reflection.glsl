#include "snippet/environment.glsl"
#include "snippet/classic_material.glsl"

// What the reflection_*.glsl of the textbook's models (shaders/README.md) share: all but reflectLight().
#define LIT
#define Reflection ClassicMaterial

ClassicMaterial reflectionOf(vec3 factor, vec3 texel) { return classicMaterial(factor * texel); }

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
