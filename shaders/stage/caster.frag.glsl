// Only casters with holes have a fragment stage.
#define VARYING in
#include "snippet/caster_varyings.glsl"
#include "snippet/material.glsl"

void main() {
    float alpha = material.baseColour.a * surface.present;
#ifdef FEATURE_VERTEX_COLOURS
    alpha *= surface.alpha;
#endif
#ifdef FEATURE_BASE_COLOUR_TEXTURE
    alpha *= SAMPLE(baseColourTexture, 0).a;
#endif
    if (alpha < material.emission.w) discard;
}
