#ifndef __cplusplus
#include "structs/prelude.glsl"
#endif

const uint kLightDirectional = 0u;
const uint kLightPoint = 1u;
const uint kLightSpot = 2u;

// One light as the shaders see it. Frame: the one that the pass shades in; the pass says which.
struct GpuLight {
    vec3 position;                // metres; unused by directional lights
    uint kind;                    // kLight...
    vec3 direction;               // unit, the way the light travels; unused by point lights
    float range;                  // metres; 0: unlimited
    vec3 irradianceOrIntensity;   // directional: W/m^2; point and spot: W/sr
    float spotCosOuter;           // spotFactor() of formula/light.glsl
    float spotScale;              // from spotScale()
    float radius;                 // metres, of the luminous sphere
    int shadowIndex;              // into the pass' shadow maps; -1: none
    uint index;                   // among the lights of the frame
};
LAYOUT_SIZE(GpuLight, 64)
LAYOUT_OFFSET(GpuLight, kind, 12)
LAYOUT_OFFSET(GpuLight, direction, 16)
LAYOUT_OFFSET(GpuLight, range, 28)
LAYOUT_OFFSET(GpuLight, irradianceOrIntensity, 32)
LAYOUT_OFFSET(GpuLight, spotCosOuter, 44)
LAYOUT_OFFSET(GpuLight, spotScale, 48)
LAYOUT_OFFSET(GpuLight, index, 60)
