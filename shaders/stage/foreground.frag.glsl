#include "snippet/frame.glsl"

// A picture or a line of text over everything, placed in wall pixels.
layout(location = 0) uniform vec4 placed;  // x, y, width, height on the wall, pixels
layout(location = 1) uniform vec4 tint;    // straight alpha
layout(binding = 0) uniform sampler2D image;
layout(location = 0) out vec4 colourOut;

void main() {
    vec2 place = (WALL_PIXEL - placed.xy) / placed.zw;
    if (any(lessThan(place, vec2(0.0))) || any(greaterThanEqual(place, vec2(1.0)))) discard;
#ifdef FOREGROUND_TEXT
    ivec2 size = textureSize(image, 0);
    ivec2 texel = ivec2(place * vec2(size));
    float alpha = tint.a * texelFetch(image, ivec2(texel.x, size.y - 1 - texel.y), 0).r;
    colourOut = vec4(tint.rgb * alpha, alpha);
#else
    vec4 texel = textureLod(image, vec2(place.x, 1.0 - place.y), 0.0);
    colourOut = vec4(texel.rgb * texel.a, texel.a) * tint;
#endif
}
