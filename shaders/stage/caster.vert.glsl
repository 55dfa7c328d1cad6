// Draws what casts a shadow into a light's map.
layout(location = 0) in vec3 position;
layout(location = 0) uniform mat4 stageFromObject;  // to clip space, or (hemisphere) to the light's frame
#ifdef CASTER_HEMISPHERE
#include "snippet/hemisphere.glsl"
#endif
#ifdef CASTER_TESSELLATED
layout(location = 0) out vec3 positionLight;
#endif
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
#if defined(CASTER_TESSELLATED)
    positionLight = (stageFromObject * vec4(position, 1.0)).xyz;
#elif defined(CASTER_HEMISPHERE)
    vec3 relative = (stageFromObject * vec4(position, 1.0)).xyz;
    gl_Position = onHemisphere(relative);
    gl_ClipDistance[0] = hemisphereClip(relative);
#else
    gl_Position = stageFromObject * vec4(position, 1.0);
#endif
}
