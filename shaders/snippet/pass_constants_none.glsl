#include "formula/guard.glsl"

// Pixels read their constants themselves.
void passConstants(vec3 relative, vec3 faceNormal) {}
