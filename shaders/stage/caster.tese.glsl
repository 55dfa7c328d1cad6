#include "snippet/hemisphere.glsl"

layout(triangles, equal_spacing, ccw) in;
layout(location = 0) in vec3 patchLight[];

void main() {
    vec3 relative = gl_TessCoord.x * patchLight[0] + gl_TessCoord.y * patchLight[1] + gl_TessCoord.z * patchLight[2];
    gl_Position = onHemisphere(relative);
    gl_ClipDistance[0] = hemisphereClip(relative);
}
