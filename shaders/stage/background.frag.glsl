#include "snippet/frame.glsl"

// Associated alpha, in whole-wall coordinates, so that tiles agree.
layout(location = 0) uniform vec4 bottom;
layout(location = 1) uniform vec4 top;
layout(location = 0) out vec4 colourOut;
#ifdef BACKGROUND_IMAGE
layout(binding = 0) uniform sampler2D image;
#endif

void main() {
    vec2 place = (WALL_PIXEL - frame.region.xy) / frame.region.zw;
#ifdef BACKGROUND_IMAGE
    // The first row of an image is its top.
    vec4 texel = textureLod(image, vec2(place.x, 1.0 - place.y), 0.0);
    colourOut = vec4(texel.rgb * texel.a, texel.a);
#else
    colourOut = mix(bottom, top, place.y);
#endif
}
