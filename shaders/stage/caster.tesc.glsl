#include "snippet/hemisphere.glsl"

// Divides a caster's edges until their chords leave the arcs by a tenth of a texel at most: the paraboloid's map is a
// stereographic projection, where a chord over the angle a deviates by mapSize * a^2 / 16 texels at most.
layout(vertices = 3) out;
layout(location = 0) in vec3 positionLight[];
layout(location = 0) out vec3 patchLight[];

// Parts of equal angles (caster.tese.glsl); by the half angle's tangent, which knows opposite directions, too.
float levelOf(vec3 a, vec3 b) {
    vec3 towardsA = a / max(length(a), 1e-30);
    vec3 towardsB = b / max(length(b), 1e-30);
    float angle = 2.0 * atan(length(towardsA - towardsB), length(towardsA + towardsB));
    return clamp(ceil(angle * sqrt(hemisphere.w) * 0.79), 1.0, 64.0);
}

// A triangle whose plane the light lies on, to a float's rounding, is seen as a line and casts nothing. The parts of one
// that surrounds the light would be a triangle of directions all around, which is most of the map.
bool isSeenAsLine(vec3 a, vec3 b, vec3 c) {
    return abs(dot(a, cross(b, c))) <= 2e-6 * length(a) * length(b) * length(c);
}

void main() {
    patchLight[gl_InvocationID] = positionLight[gl_InvocationID];
    if (gl_InvocationID == 0 && isSeenAsLine(positionLight[0], positionLight[1], positionLight[2])) {
        gl_TessLevelOuter[0] = gl_TessLevelOuter[1] = gl_TessLevelOuter[2] = 0.0;
        gl_TessLevelInner[0] = 0.0;
    } else if (gl_InvocationID == 0) {
        gl_TessLevelOuter[0] = levelOf(positionLight[1], positionLight[2]);
        gl_TessLevelOuter[1] = levelOf(positionLight[2], positionLight[0]);
        gl_TessLevelOuter[2] = levelOf(positionLight[0], positionLight[1]);
        gl_TessLevelInner[0] = max(max(gl_TessLevelOuter[0], gl_TessLevelOuter[1]), gl_TessLevelOuter[2]);
    }
}
