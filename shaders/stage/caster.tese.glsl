#include "snippet/hemisphere.glsl"

layout(triangles, equal_spacing, ccw) in;
layout(location = 0) in vec3 patchLight[];

// A point as the light sees it: xyz its direction, of unit length, w one over its distance. What lies between two points on
// the straight line through them is a mix of theirs with the same weights.
vec4 seenFromLight(vec3 point) {
    float far = max(length(point), 1e-30);
    return vec4(point, 1.0) / far;
}

// Between a and b at shares of the angle from one to the other, not of the length: an edge that passes close by the light
// turns through most of its angle on a small part of its length. Shares add up to 1. Bits do not depend on the order, so
// neighbours share their edges.
vec4 betweenByAngle(vec4 a, vec4 b, float shareA, float shareB) {
    float angle = 2.0 * atan(length(a.xyz - b.xyz), length(a.xyz + b.xyz));
    float sine = sin(angle);
    // Below, sines are angles to a millionth. Opposite directions, the light on the line itself, have no way between.
    bool isStraight = angle < 1e-3 || sine < 1e-6;
    float weightA = isStraight ? shareA : sin(shareA * angle) / sine;
    float weightB = isStraight ? shareB : sin(shareB * angle) / sine;
    return weightA * a + weightB * b;
}

void main() {
    float last = gl_TessCoord.x + gl_TessCoord.y;
    float sum = last + gl_TessCoord.z;
    vec4 a = seenFromLight(patchLight[0]);
    vec4 b = seenFromLight(patchLight[1]);
    vec4 c = seenFromLight(patchLight[2]);
    // First along the edge from a to b, then from there to c: along each edge this is the edge's own mix.
    vec4 onEdge = last > 0.0 ? betweenByAngle(a, b, gl_TessCoord.x / last, gl_TessCoord.y / last) : a;
    vec4 seen = betweenByAngle(onEdge, c, last / sum, gl_TessCoord.z / sum);
    vec3 relative = seen.xyz / seen.w;
    gl_Position = onHemisphere(relative);
    gl_ClipDistance[0] = hemisphereClip(relative);
}
