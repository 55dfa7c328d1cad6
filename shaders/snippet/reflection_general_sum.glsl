#include "snippet/classic_reflection.glsl"

// The general sum (5.13). Its a_i and s_i are a light's ambientShare and highlightShare (light_sum.glsl).
// shaders/README.md says what a reflection_*.glsl defines.
vec3 reflectLight(ClassicMaterial reflection, vec3 normal, vec3 toLight, vec3 toEye) {
    return generalSumTerm(reflection, vec3(0.0), vec3(1.0), vec3(1.0), normal, toLight, toEye) * kInversePi;
}
