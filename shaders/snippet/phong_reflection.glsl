#include "snippet/environment.glsl"
#include "formula/lambert.glsl"
#include "formula/phong.glsl"
#include "snippet/material.glsl"

// What the reflection_*.glsl of Phong's lobe as a BRDF (shaders/README.md) share.
#define LIT
#define Reflection PhongReflection

struct PhongReflection {
    vec3 diffuse;
    vec3 specular;
    float shininess;
};

PhongReflection reflectionOf(vec3 factor, vec3 texel) {
    return PhongReflection(factor * texel, specularColour(), MATERIAL.specular.w);
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
