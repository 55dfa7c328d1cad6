#include "formula/classic_models.glsl"
#include "snippet/material.glsl"

// What the textbook's models have in common. Their colours are in and out without pi; a light's colour is its
// irradiance / pi (docs/illumination.md, Units).

ClassicMaterial classicMaterial(vec3 diffuse) {
    ClassicMaterial classic;
    classic.ambient = MATERIAL.ambient.rgb;
    classic.diffuse = diffuse;
    classic.specular = specularColour();
    classic.shininess = MATERIAL.specular.w;
    return classic;
}

// (n.l) d_P + highlight s_P, 1/sr. Of matt materials s_P is 0: compilers then see that nobody needs the highlight.
vec3 classicSum(ClassicMaterial classic, vec3 normal, vec3 toLight, float highlight) {
#ifdef FEATURE_MATT
    return diffuseReflect(classic.diffuse, vec3(1.0), normal, toLight) * kInversePi;
#else
    return (diffuseReflect(classic.diffuse, vec3(1.0), normal, toLight) + classic.specular * highlight) * kInversePi;
#endif
}

vec3 classicAmbient(ClassicMaterial classic, vec3 radiance, float occlusion) {
    return ambientReflect(classic.ambient, radiance) * occlusion;
}
