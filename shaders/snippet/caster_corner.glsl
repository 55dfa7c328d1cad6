// What a vertex of a caster with holes hands on.
#ifdef FEATURE_ALPHA_MASK
layout(location = 3) in vec4 colour;
layout(location = 4) in vec2 texCoords0;
layout(location = 5) in vec2 texCoords1;
#define VARYING out
#include "snippet/caster_varyings.glsl"

void handOnHoles() {
#ifdef FEATURE_VERTEX_COLOURS
    surface.alpha = colour.a;
#endif
#ifdef FEATURE_TEX_COORDS0
    surface.texCoords0 = texCoords0;
#endif
#ifdef FEATURE_TEX_COORDS1
    surface.texCoords1 = texCoords1;
#endif
    surface.present = 1.0;
}
#else
void handOnHoles() {}
#endif
