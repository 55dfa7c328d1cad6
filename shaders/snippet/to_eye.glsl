#include "formula/guard.glsl"
#include "snippet/frame.glsl"

// Unit, world axes, from a place towards the eye; of an orthographic view the same everywhere.
vec3 directionToEye(vec3 relative) {
    return frame.forward.w > 0.5 ? -frame.forward.xyz : normalizeOr(-relative, -frame.forward.xyz);
}
