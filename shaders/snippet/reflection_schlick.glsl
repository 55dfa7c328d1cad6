#include "snippet/classic_reflection.glsl"

// Schlick's substitute for the power, of the half vector. shaders/README.md says what a reflection_*.glsl defines.
vec3 reflectLight(ClassicMaterial reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    return classicSum(reflection, normal, toLight, schlickHighlight(normal, toLight, toEye, reflection.shininess));
}
