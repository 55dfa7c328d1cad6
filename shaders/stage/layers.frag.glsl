#include "snippet/frame.glsl"
#define VARYING in
#include "snippet/surface_varyings.glsl"
#include "snippet/material.glsl"
#include "snippet/surface_frame.glsl"
#include "snippet/lights.glsl"

// What is known of the nearest surface. LAYER_... is the output location of each layer that was asked for.
#ifdef LAYER_DEPTH
layout(location = LAYER_DEPTH) out float depthOut;
#endif
#ifdef LAYER_POSITION
layout(location = LAYER_POSITION) out vec4 positionOut;
#endif
#ifdef LAYER_NORMAL
layout(location = LAYER_NORMAL) out vec4 normalOut;
#endif
#ifdef LAYER_IDS
layout(location = LAYER_IDS) out uvec2 idsOut;
layout(location = 4) uniform uvec2 nodeId;  // low 32 bits; y: 1 when triangles were reordered
layout(binding = 8) uniform usamplerBuffer primitives;
#endif
#ifdef LAYER_DARKNESS
layout(location = 0) out float darknessOut;  // as snippet/shadow_view.glsl reads it
// Of the light, among those of the item.
#ifdef LIGHT_COUNT
const uint darkLight = LAYER_DARKNESS;
#else
layout(location = 5) uniform uint darkLight;
#endif
#endif
#ifdef LAYER_FACTORS
layout(location = 0) out vec4 factorsOut[LAYER_FACTORS];
layout(location = 5) uniform uint firstLight;
#endif

void main() {
#ifdef FEATURE_ALPHA_MASK
    float alpha = MATERIAL.baseColour.a;
#ifdef FEATURE_VERTEX_COLOURS
    alpha *= surface.colour.a;
#endif
#ifdef FEATURE_BASE_COLOUR_TEXTURE
    alpha *= SAMPLE(baseColourTexture, 0).a;
#endif
#endif
    vec3 faceNormal = faceNormalWorld() * (gl_FrontFacing ? 1.0 : -1.0);
#ifdef LAYER_DEPTH
    depthOut = dot(surface.relative, frame.forward.xyz);
#endif
#ifdef LAYER_POSITION
    positionOut = vec4(surface.relative, 1.0);
#endif
#ifdef LAYER_NORMAL
    normalOut = vec4(faceNormal, 1.0);
#endif
#ifdef LAYER_IDS
    int triangle = int(surface.firstTriangle) + gl_PrimitiveID;
    idsOut = uvec2(nodeId.x, nodeId.y != 0u ? texelFetch(primitives, triangle).x : uint(triangle));
#endif
#ifdef LAYER_DARKNESS
    GpuLight light = lightAt(darkLight);
    vec3 toLight;
    irradianceFrom(light, surface.relative, toLight);
    darknessOut = 1.0 - shadowFactor(darkLight, light, surface.relative, faceNormal, toLight);
#endif
#ifdef LAYER_FACTORS
    float factors[4 * LAYER_FACTORS];
    for (int i = 0; i < 4 * LAYER_FACTORS; ++i) factors[i] = 0.0;
    for (uint i = 0u; i < lightCount(); ++i) {
        GpuLight light = lightAt(i);
        if (light.index < firstLight || light.index >= firstLight + uint(4 * LAYER_FACTORS)) continue;
        vec3 toLight;
        irradianceFrom(light, surface.relative, toLight);
#ifdef FEATURE_UNWRAPPED
        // Nobody looks from any side; the biases know the side that faces away.
        faceNormal = faceNormalWorld();
#endif
        factors[light.index - firstLight] = shadowFactor(i, light, surface.relative, faceNormal, toLight);
    }
    for (int i = 0; i < LAYER_FACTORS; ++i)
        factorsOut[i] = vec4(factors[4 * i], factors[4 * i + 1], factors[4 * i + 2], factors[4 * i + 3]);
#endif
#ifdef FEATURE_ALPHA_MASK
    if (alpha < MATERIAL.emission.w) discard;
#endif
}
