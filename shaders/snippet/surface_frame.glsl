#include "formula/guard.glsl"

layout(location = 1) uniform mat3 normalFromObject;
layout(binding = 7) uniform samplerBuffer faceNormals;

// Unit, world axes, on the side of the winding; from a table, as derivatives would differ between tiles.
vec3 faceNormalWorld() {
    vec3 normal = texelFetch(faceNormals, int(surface.firstTriangle) + gl_PrimitiveID).xyz;
    return normalizeOr(normalFromObject * normal, vec3(0.0, 0.0, 1.0));
}

vec3 directionToEye() {
    return frame.forward.w > 0.5 ? -frame.forward.xyz : normalizeOr(-surface.relative, -frame.forward.xyz);
}
