#include "snippet/phong_reflection.glsl"

// Lambert and the energy-normalised lobe of Phong: diffuse + specular <= 1 conserves energy. shaders/README.md says what a reflection_*.glsl defines.
vec3 reflectLight(PhongReflection reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    return lambertBrdf(reflection.diffuse) * max(dot(normal, toLight), 0.0) +
           normalisedPhongReflect(reflection.specular, reflection.shininess, normal, toLight, toEye);
}

vec3 reflectAmbient(PhongReflection reflection, vec3 radiance, float occlusion) {
    return (reflection.diffuse + reflection.specular) * radiance * occlusion;
}
