#ifndef __cplusplus
#include "structs/prelude.glsl"
#endif

const uint kShadowSingle = 0u;
const uint kShadowCube = 1u;        // six of these in a row, +x -x +y -y +z -z
const uint kShadowHemisphere = 2u;  // two of these in a row, -z +z of the light
const uint kShadowInView = 3u;      // no map: a layer of the darkness images
const uint kShadowLightMap = 4u;    // a light of the light map: its number and the atlas' size are layer and mapSize

const uint kNoChart = 0xffffffffu;  // of a triangle in no light map

// One part of a light's shadow map: a layer of the pass' depth array. Lengths in metres, points relative to the eye
// unless said otherwise. Across the light, t is a place on the map's plane: metres (directional), or metres at unit
// distance (perspective). A texel at map coordinates m = (x, y, 1), x and y in [-1, 1], covers (texelX - warpX p, texelY -
// warpY p) * s / dot(unwarp, m): p is the place across the light of what is mapped, s its scale (1, or the distance).
struct GpuShadow {
    mat4 clipFromRelative;  // xyw: the map, warped or not; z: never warped (common/wall/view.h)
    vec3 texelX;            // world axes: t per texel along the map's x, at the origin of t, where unwarp is 1
    float warpX;
    vec3 texelY;
    float warpY;
    vec3 axisZ;             // unit, world axes, against the light's way
    float isPerspective;    // 1: texels grow with the distance along axisZ
    vec3 origin;            // where t is 0: the light, or the eye itself
    float mapSize;          // texels along each side
    vec3 unwarp;            // depth = stored depth / dot(unwarp, m)
    float layer;
    float constantBias;     // texels, towards the light
    float normalOffset;     // texels above the surface's plane: the reach of shadowNormalOffset()
    float depthScale;       // distance from the light along its axis: offset - scale * depth (directional),
    float depthOffset;      //   scale / (depth + offset) (perspective)
    float filterTexels;     // width of a filter
    float filterMetres;     // instead, where positive
    float lightSize;        // metres; directional: metres of penumbra per metre
    float maxTexels;        // of a penumbra
    uint shape;
    uint filterSamples;     // along each side of a filter
    uint blockerSamples;    // along each side of the search for blockers
    uint boundsBlock;       // texels along each side of a block of shadowBounds
    // Of parallel maps, what their lookups need, multiplied out. Rows: relative to texels from the map's corner, on warped
    // ones times w.
    vec4 texelRowX;
    vec4 texelRowY;
    float depthAtEye;       // undistorted; constantBias included where no warp makes it vary
    float unused1;
    float unused2;
    float unused3;
    float offsetX;          // metres above the plane per texel that a unit normal leads along the map's x: normalOffset
    float offsetY;          //   times the squared side; the same for y
    float depthPerMetre;    // towards the light
    uint besideMap;         // beside a light map: how many records on the maps of what moves begin, which those of what
                            //   is in it follow; 0: there are none
};
LAYOUT_SIZE(GpuShadow, 256)
LAYOUT_OFFSET(GpuShadow, warpX, 76)
LAYOUT_OFFSET(GpuShadow, texelY, 80)
LAYOUT_OFFSET(GpuShadow, axisZ, 96)
LAYOUT_OFFSET(GpuShadow, origin, 112)
LAYOUT_OFFSET(GpuShadow, mapSize, 124)
LAYOUT_OFFSET(GpuShadow, layer, 140)
LAYOUT_OFFSET(GpuShadow, constantBias, 144)
LAYOUT_OFFSET(GpuShadow, depthOffset, 156)
LAYOUT_OFFSET(GpuShadow, filterTexels, 160)
LAYOUT_OFFSET(GpuShadow, shape, 176)
LAYOUT_OFFSET(GpuShadow, boundsBlock, 188)
LAYOUT_OFFSET(GpuShadow, depthAtEye, 224)
