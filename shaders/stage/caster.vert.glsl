// Draws what casts a shadow into a light's map.
layout(location = 0) in vec3 position;
layout(location = 0) uniform mat4 stageFromObject;  // to clip space, or (hemisphere) to the light's frame
#ifdef CASTER_HEMISPHERE
#include "snippet/hemisphere.glsl"
#endif
#ifdef CASTER_TESSELLATED
layout(location = 0) out vec3 positionLight;
#endif
#include "snippet/caster_corner.glsl"

void main() {
    handOnHoles();
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
