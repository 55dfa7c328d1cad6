// Draws triangles into many pictures of visibility maps at once: one instance for each picture, side by side.
#include "structs/raster_eye.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in uint picture;  // one for each instance
layout(std430, binding = 0) readonly buffer Eyes {
    GpuRasterEye eyes[];
};
#ifdef FEATURE_FAR
out vec3 fromOrigin;
#endif
out float gl_ClipDistance[4];

void main() {
    GpuRasterEye eye = eyes[picture];
    vec3 p = position - eye.origin;
    float w = dot(eye.depthRow.xyz, p) + eye.depthRow.w;
    float x = dot(eye.xRow.xyz, p) + eye.xRow.w;
    float y = dot(eye.yRow.xyz, p) + eye.yRow.w;
    gl_ClipDistance[0] = w + x;
    gl_ClipDistance[1] = w - x;
    gl_ClipDistance[2] = w + y;
    gl_ClipDistance[3] = w - y;
    // Nothing is too far away: z is w - 2 near in the limit of an infinite far plane (Ganster 2002, eq. 13).
    gl_Position = vec4(eye.place.x * x + eye.place.z * w, eye.place.y * y + eye.place.w * w, w - 2.0 * eye.nearest, w);
#ifdef FEATURE_FAR
    fromOrigin = p;
#endif
}
