#include "snippet/environment.glsl"
#include "snippet/classic_material.glsl"

// OpenGL's sum: the texture dims all of it, highlights and ambient light too. A light's a_i is its ambientShare
// (light_sum.glsl). shaders/README.md says what a reflection_*.glsl defines.
#define LIT
#define Reflection OpenGlReflection

struct OpenGlReflection {
    ClassicMaterial classic;
    vec3 texel;
};

OpenGlReflection reflectionOf(vec3 factor, vec3 texel) {
    OpenGlReflection reflection;
    reflection.classic = classicMaterial(factor);
    reflection.texel = texel;
    return reflection;
}

vec3 reflectLight(OpenGlReflection reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    vec3 term = openGlSumTerm(reflection.classic, vec3(0.0), vec3(1.0), kInversePi, normal, toLight, toEye);
    return openGlSum(vec3(0.0), vec3(0.0), reflection.texel, vec3(0.0), vec3(0.0), term);
}

vec3 reflectAmbient(OpenGlReflection reflection, vec3 radiance, float occlusion) {
    return openGlSum(vec3(0.0), vec3(0.0), reflection.texel, reflection.classic.ambient, radiance, vec3(0.0)) *
           occlusion;
}

OpenGlReflection withHighlight(OpenGlReflection reflection, vec3 share) {
    reflection.classic.specular *= share;
    return reflection;
}

#ifdef FEATURE_ENVIRONMENT
EnvironmentShare environmentShare(OpenGlReflection reflection) {
    return EnvironmentShare(reflection.texel * reflection.classic.diffuse,
                            reflection.texel * reflection.classic.specular,
                            roughnessFromExponent(reflection.classic.shininess), kEnvironmentPlain);
}
#endif
