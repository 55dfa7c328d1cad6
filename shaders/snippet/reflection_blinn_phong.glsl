#include "formula/blinn_phong.glsl"
#include "snippet/material.glsl"

// The half vector's highlight. shaders/README.md says what a reflection_*.glsl defines.
#define LIT
#define Reflection BlinnPhong

BlinnPhong reflectionOf(vec3 factor, vec3 texel) {
    BlinnPhong reflection;
    reflection.diffuse = factor * texel;
    reflection.specular = specularColour();
    reflection.shininess = material.specular.w;
    return reflection;
}

vec3 reflectLight(BlinnPhong reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    return blinnPhongReflect(reflection, normal, toLight, toEye);
}

vec3 reflectAmbient(BlinnPhong reflection, vec3 radiance, float occlusion) {
    return blinnPhongAmbient(material.ambient.rgb, radiance, occlusion);
}
