#include "snippet/material.glsl"

// What a surface is coloured with at a pixel, before any light: factors of the material and the vertices, and texels.

vec4 baseFactor() {
#ifdef FEATURE_VERTEX_COLOURS
    return MATERIAL.baseColour * surface.colour;
#else
    return MATERIAL.baseColour;
#endif
}

vec4 baseTexel() {
#ifdef FEATURE_BASE_COLOUR_TEXTURE
    return SAMPLE(baseColourTexture, 0);
#else
    return vec4(1.0);
#endif
}

vec3 emittedRadiance() {
#if defined(FEATURE_EMISSION_TEXTURE)
    return MATERIAL.emission.rgb * SAMPLE(emissionTexture, 4).rgb;
#elif defined(FEATURE_EMISSION)
    return MATERIAL.emission.rgb;
#else
    return vec3(0.0);
#endif
}
