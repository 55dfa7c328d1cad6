// A shadow volume: the caster's own vertices, some of them at infinity straight away from the light.
#include "snippet/frame.glsl"
layout(location = 0) in uint corner;  // number of the vertex; highest bit: at infinity
layout(std430, binding = 3) readonly buffer Positions { float positions[]; };

layout(location = 0) uniform mat4 relativeFromObject;
layout(location = 1) uniform vec4 lightObject;  // w 1: a position, w 0: the direction towards it
layout(location = 3) uniform float reach;       // how often the way from the light is added; 0: infinitely

invariant gl_Position;  // caps lie on the surfaces to the bit: as in stage/surface.vert.glsl

void main() {
    uint first = 3u * (corner & 0x7fffffffu);
    vec3 position = vec3(positions[first], positions[first + 1u], positions[first + 2u]);
    vec4 relative = relativeFromObject * vec4(position, 1.0);
    vec4 away = relativeFromObject * vec4(position * lightObject.w - lightObject.xyz, 0.0);
    if ((corner & 0x80000000u) == 0u)
        gl_Position = frame.clipFromRelative * vec4(relative.xyz, 1.0);
    else if (reach > 0.0)
        gl_Position = frame.clipFromRelative * vec4(relative.xyz + reach * away.xyz, 1.0);
    else
        gl_Position = frame.clipFromRelative * vec4(away.xyz, 0.0);
}
