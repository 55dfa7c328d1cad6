#include "snippet/frame.glsl"
#include "snippet/held_colour.glsl"

// Associated alpha, in whole-wall coordinates, so that tiles agree.
layout(location = 0) uniform vec4 bottom;
layout(location = 1) uniform vec4 top;
layout(location = 0) out vec4 colourOut;
#ifdef BACKGROUND_IMAGE
layout(binding = 0) uniform sampler2D image;
#endif
#ifdef BACKGROUND_ENVIRONMENT
layout(binding = 12) uniform samplerCube environmentRadiance;
layout(location = 2) uniform mat4 relativeFromClip;  // of the whole region
layout(location = 12) uniform mat3 environmentFromWorld;
layout(location = 13) uniform vec4 environmentScale;
#endif

void main() {
    vec2 place = (WALL_PIXEL - frame.region.xy) / frame.region.zw;
#ifdef BACKGROUND_IMAGE
    // The first row of an image is its top.
    vec4 texel = textureLod(image, vec2(place.x, 1.0 - place.y), 0.0);
    colourOut = vec4(texel.rgb * texel.a, texel.a);
#elif defined(BACKGROUND_ENVIRONMENT)
    vec4 onNearPlane = relativeFromClip * vec4(place * 2.0 - 1.0, 1.0, 1.0);
    vec3 direction = frame.forward.w > 0.5 ? frame.forward.xyz : onNearPlane.xyz / onNearPlane.w;
    colourOut = vec4(textureLod(environmentRadiance, environmentFromWorld * direction, 0.0).rgb * environmentScale.rgb, 1.0);
#else
    colourOut = mix(bottom, top, place.y);
#endif
    colourOut.rgb = heldColour(colourOut.rgb);
}
