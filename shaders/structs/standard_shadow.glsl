#ifndef __cplusplus
#include "structs/prelude.glsl"
#endif

// One light's standard shadow map: a layer of the pass' depth array. Lengths in metres.
struct GpuStandardShadow {
    mat4 clipFromRelative;  // from eye-relative world coordinates; z in [0, 1], 1 nearest the light
    vec3 axisX;             // the map's axes, unit, in world axes
    float texelSize;        // of a texel; of a perspective map at unit distance
    vec3 axisY;
    float mapSize;          // texels along each side
    float constantBias;     // texels, towards the light
    float normalOffset;     // texels, along the geometric normal: the reach of shadowNormalOffset()
    float isPerspective;    // 1: the texel's size grows with the distance along the light's axis
    float layer;
};
LAYOUT_SIZE(GpuStandardShadow, 112)
LAYOUT_OFFSET(GpuStandardShadow, texelSize, 76)
LAYOUT_OFFSET(GpuStandardShadow, mapSize, 92)
LAYOUT_OFFSET(GpuStandardShadow, layer, 108)
