#ifndef __cplusplus
#include "structs/prelude.glsl"
#endif

const uint kLightDirectional = 0u;
const uint kLightPoint = 1u;
const uint kLightSpot = 2u;
const uint kLightGoniometric = 3u;

// How a spot fades away from its axis.
const uint kSpotEdge = 0u;     // spotFactor(): between an inner and an outer angle
const uint kSpotCone = 1u;     // spotCone(): a power, cut off at a cone
const uint kSpotProduct = 2u;  // spotClampedProduct(): a power, clamped together with the attenuation

// How light fades with distance.
const uint kFadeInverseSquare = 0u;
const uint kFadePolynomial = 1u;  // artistAttenuation()

// One light as the shaders see it. Frame: the one that the pass shades in; the pass says which.
struct GpuLight {
    vec3 position;                // metres; unused by directional lights
    uint kind;                    // kLight...
    vec3 direction;               // unit, the way the light travels; unused by point lights
    float range;                  // metres; 0: unlimited
    vec3 irradianceOrIntensity;   // directional: W/m^2; others: W/sr, or W/m^2 at attenuation 1
    float spotCosOuter;           // of spotFactor() or spotCone()
    float spotScale;              // from spotScale()
    float radius;                 // metres, of the luminous sphere
    int shadowIndex;              // into the pass' shadow maps; -1: none
    uint index;                   // among the lights of the frame
    vec3 attenuation;             // kc, kl, kq
    uint fade;                    // kFade...
    vec3 axisX;                   // where C = 0 of a photometric web lies, unit, perpendicular to direction
    float spotExponent;
    vec3 ambientShare;            // of its irradiance / pi, that it adds to the ambient light
    uint spotForm;                // kSpot...
    vec3 highlightShare;          // of its light, that highlights see
    uint webFirst;                // entry of the photometric web in the list of all
    uint webColumns;
    uint webRows;
    uint darknessLayer;           // of its shadow, where factors are made in the view
    uint unused0;
};
LAYOUT_SIZE(GpuLight, 144)
LAYOUT_OFFSET(GpuLight, kind, 12)
LAYOUT_OFFSET(GpuLight, direction, 16)
LAYOUT_OFFSET(GpuLight, range, 28)
LAYOUT_OFFSET(GpuLight, irradianceOrIntensity, 32)
LAYOUT_OFFSET(GpuLight, spotCosOuter, 44)
LAYOUT_OFFSET(GpuLight, spotScale, 48)
LAYOUT_OFFSET(GpuLight, index, 60)
LAYOUT_OFFSET(GpuLight, attenuation, 64)
LAYOUT_OFFSET(GpuLight, axisX, 80)
LAYOUT_OFFSET(GpuLight, spotForm, 108)
LAYOUT_OFFSET(GpuLight, webFirst, 124)
LAYOUT_OFFSET(GpuLight, webRows, 132)
