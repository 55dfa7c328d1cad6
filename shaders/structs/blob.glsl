#ifndef __cplusplus
#include "structs/prelude.glsl"
#endif

// A blob under an object: eye-relative world.
struct GpuBlob {
    vec4 light;       // w 1: a position, w 0: the unit direction towards it
    vec3 centre;
    float radius;     // metres, across the light, at the centre
    vec4 boxFromX;    // rows: where the object's own box is the cube of [-1, 1], which gets no blob
    vec4 boxFromY;
    vec4 boxFromZ;
};
LAYOUT_SIZE(GpuBlob, 80)
LAYOUT_OFFSET(GpuBlob, radius, 28)
LAYOUT_OFFSET(GpuBlob, boxFromZ, 64)
