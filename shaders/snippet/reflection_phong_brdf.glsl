#include "snippet/phong_reflection.glsl"

// Ganster's k_d / pi and k_s cos^m / cos: not reciprocal, does not conserve energy. shaders/README.md says what a reflection_*.glsl defines.
vec3 reflectLight(PhongReflection reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    return lambertBrdf(reflection.diffuse) * max(dot(normal, toLight), 0.0) +
           nonReciprocalPhongReflect(reflection.specular, reflection.shininess, normal, toLight, toEye);
}

vec3 reflectAmbient(PhongReflection reflection, vec3 radiance, float occlusion) {
    return reflection.diffuse * radiance * occlusion;
}
