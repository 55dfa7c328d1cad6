#include "snippet/classic_reflection.glsl"

// Phong's model, dark where the light is behind (5.10). shaders/README.md says what a reflection_*.glsl defines.
vec3 reflectLight(ClassicMaterial reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    return classicSum(reflection, normal, toLight, phongHighlightGated(normal, toLight, toEye, reflection.shininess));
}
