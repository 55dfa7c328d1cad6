// Draws what casts a shadow into a light's map.
layout(location = 0) in vec3 position;
layout(location = 0) uniform mat4 clipFromObject;
#ifdef FEATURE_ALPHA_MASK
layout(location = 3) in vec4 colour;
layout(location = 4) in vec2 texCoords0;
layout(location = 5) in vec2 texCoords1;
#define VARYING out
#include "snippet/caster_varyings.glsl"
#endif

void main() {
#ifdef FEATURE_ALPHA_MASK
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
#endif
    gl_Position = clipFromObject * vec4(position, 1.0);
}
