#include "snippet/caster_varyings.glsl"
#include "snippet/material.glsl"

// Whether a caster that a texture cuts out has nothing here. Where textures may be looked up: in uniform control flow.
bool isHole() {
    float alpha = MATERIAL.baseColour.a * surface.present;
#ifdef FEATURE_VERTEX_COLOURS
    alpha *= surface.alpha;
#endif
#ifdef FEATURE_BASE_COLOUR_TEXTURE
    alpha *= SAMPLE(baseColourTexture, 0).a;
#endif
    return alpha < MATERIAL.emission.w;
}
