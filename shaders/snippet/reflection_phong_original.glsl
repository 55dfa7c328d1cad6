#include "snippet/environment.glsl"
#include "snippet/classic_material.glsl"

// Phong's own combination (5.12): a share of the colour needs no light to face it, nor is it shadowed; the rest is
// reflectLight(). shaders/README.md says what a reflection_*.glsl defines.
#define LIT
#define Reflection PhongOriginal

PhongOriginal reflectionOf(vec3 factor, vec3 texel) {
    PhongOriginal reflection;
    reflection.colour = factor * texel;
    reflection.ambient = MATERIAL.ambient.w;
    reflection.specular = specularColour();
    reflection.shininess = MATERIAL.specular.w;
    return reflection;
}

vec3 reflectLight(PhongOriginal reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    reflection.colour *= 1.0 - reflection.ambient;
    reflection.ambient = 0.0;
    return phongOriginal(reflection, normal, toLight, toEye) * kInversePi;
}

vec3 reflectAmbient(PhongOriginal reflection, vec3 radiance, float occlusion) {
    return reflection.colour * reflection.ambient * radiance * occlusion;
}

#define REFLECTS_UNSHADOWED
vec3 reflectUnshadowed(PhongOriginal reflection) { return reflection.colour * reflection.ambient * kInversePi; }

PhongOriginal withHighlight(PhongOriginal reflection, vec3 share) {
    reflection.specular *= share;
    return reflection;
}

#ifdef FEATURE_ENVIRONMENT
EnvironmentShare environmentShare(PhongOriginal reflection) {
    return EnvironmentShare(reflection.colour * (1.0 - reflection.ambient), reflection.specular,
                            roughnessFromExponent(reflection.shininess), kEnvironmentPlain);
}
#endif
