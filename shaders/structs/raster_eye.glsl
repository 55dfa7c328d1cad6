#ifndef __cplusplus
#include "structs/prelude.glsl"
#endif

// One picture of a visibility map: from where, which way, and its place among the pictures drawn at once. Lengths are
// the mesh's own, divided by a power of two.
struct GpuRasterEye {
    vec3 origin;       // the mesh's point, without the lift: differences to it are exact near it
    float nearest;     // distance of the near plane
    vec4 depthRow;     // xyz . (p - origin) + w: the clip w, the depth along the view
    vec4 xRow;         // likewise the clip x: -w to w in the picture
    vec4 yRow;
    vec4 place;        // picture to target: xy scale, zw offset, in normalised device coordinates
};
LAYOUT_SIZE(GpuRasterEye, 80)
LAYOUT_OFFSET(GpuRasterEye, nearest, 12)
LAYOUT_OFFSET(GpuRasterEye, depthRow, 16)
LAYOUT_OFFSET(GpuRasterEye, place, 64)
