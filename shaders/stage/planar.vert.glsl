// A caster flattened onto a plane along the light's rays.
#include "snippet/frame.glsl"
#include "snippet/caster_corner.glsl"
layout(location = 0) in vec3 position;
layout(location = 0) uniform mat4 flatFromObject;    // to eye-relative world, homogeneous
layout(location = 1) uniform vec4 planeObject;       // positive on the light's side
layout(location = 2) uniform vec4 belowLightObject;  // positive between the light and the plane

out gl_PerVertex {
    vec4 gl_Position;
    float gl_ClipDistance[2];
};
out vec4 flattened;

void main() {
    handOnHoles();
    vec4 point = vec4(position, 1.0);
    flattened = flatFromObject * point;
    gl_Position = frame.clipFromRelative * flattened;
    gl_ClipDistance[0] = dot(planeObject, point);
    gl_ClipDistance[1] = dot(belowLightObject, point);
}
