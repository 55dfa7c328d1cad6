#include "snippet/classic_reflection.glsl"

// Blinn's half vector (5.11). shaders/README.md says what a reflection_*.glsl defines.
vec3 reflectLight(ClassicMaterial reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    return classicSum(reflection, normal, toLight, blinnPhongHighlight(normal, toLight, toEye, reflection.shininess));
}
