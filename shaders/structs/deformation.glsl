#ifndef __cplusplus
#include "structs/prelude.glsl"
#endif

// A joint's map from rest to the geometry's frame; an affine map by columns. w is unused.
struct GpuJoint {
    vec4 x;
    vec4 y;
    vec4 z;
    vec4 origin;
};
LAYOUT_SIZE(GpuJoint, 64)
LAYOUT_OFFSET(GpuJoint, origin, 48)

// The four joints of a vertex and their weights, which sum to 1.
struct GpuInfluence {
    uvec4 joints;
    vec4 weights;
};
LAYOUT_SIZE(GpuInfluence, 32)
LAYOUT_OFFSET(GpuInfluence, weights, 16)
