#ifndef __cplusplus
#include "structs/light.glsl"
#include "structs/prelude.glsl"
#include "structs/shadow.glsl"
#endif

const uint kBlockLights = 4u;
const uint kBlockParts = 6u;  // of a light's shadow: a cube's faces

// The lights that reach a draw item, when they are few: constants at places known when the shader is compiled. Loads from a
// list cost a software renderer more than all of the shading: it fetches each number for each pixel by itself.
struct BlockLight {
    GpuLight light;  // shadowIndex: -1 or not, nothing else
    GpuShadow shadows[kBlockParts];
    vec4 unused[3];  // four of these are a multiple of the 256 bytes at which any driver takes a uniform block
};
LAYOUT_SIZE(BlockLight, 1728)
LAYOUT_OFFSET(BlockLight, shadows, 144)
