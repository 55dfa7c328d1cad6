#include "formula/guard.glsl"
#include "snippet/frame.glsl"

// Unit, world axes, from a place towards the eye; of an orthographic view the same everywhere.
vec3 directionToEye(vec3 relative) {
#ifdef FEATURE_ORTHOGRAPHIC
    return -frame.forward.xyz;
#else
    return normalizeOr(-relative, vec3(0.0, 0.0, 1.0));  // nothing visible is where the eye is
#endif
}
