#include "snippet/classic_reflection.glsl"

// Phong's model (5.9): the mirrored light, ungated. shaders/README.md says what a reflection_*.glsl defines.
vec3 reflectLight(ClassicMaterial reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    return classicSum(reflection, normal, toLight, phongHighlight(normal, toLight, toEye, reflection.shininess));
}
