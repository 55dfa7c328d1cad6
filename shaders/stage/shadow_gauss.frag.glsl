// One direction of a Gauss filter over a layer of darkness, in steps of one pixel of the wall, that ends on either side at
// the first edge and at the viewport's border. What is left of the weights is divided by their sum.
#include "snippet/frame.glsl"
#include "snippet/view_images.glsl"
#ifdef FROM_LAYER
layout(binding = 11) uniform VIEW_LAYERS darkness;
#else
layout(binding = 11) uniform VIEW_IMAGE darkness;
#endif
layout(binding = 15) uniform VIEW_IMAGE edges;  // stage/shadow_edges.frag.glsl
layout(location = 0) uniform ivec4 direction;    // xy: to the next pixel; z: the layer; w: pixels on either side
layout(location = 1) uniform float weights[33];  // from the middle outwards
layout(location = 0) out float darknessOut;

float darknessAt(ivec2 at) {
#ifdef FROM_LAYER
    return clamp(texelFetch(darkness, ivec3(at, direction.z), SAMPLE_INDEX).r, 0.0, 1.0);
#else
    return texelFetch(darkness, at, SAMPLE_INDEX).r;
#endif
}

void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    ivec2 first = ivec2(frame.region.xy - frame.wallOrigin.xy);
    ivec2 last = first + ivec2(frame.region.zw) - 1;
    float sum = weights[0] * darknessAt(here);
    float used = weights[0];
    uint axis = direction.x != 0 ? 1u : 2u;
    for (int side = -1; side <= 1; side += 2)
        for (int i = 1; i <= direction.w; ++i) {
            ivec2 at = here + side * i * direction.xy;
            if (any(lessThan(at, first)) || any(greaterThan(at, last))) break;
#ifdef WITH_EDGES
            // Kept at the left or lower one of two pixels.
            ivec2 keeper = side > 0 ? at - direction.xy : at;
            if ((uint(texelFetch(edges, keeper, SAMPLE_INDEX).r * 255.0 + 0.5) & axis) != 0u) break;
#endif
            sum += weights[i] * darknessAt(at);
            used += weights[i];
        }
    darknessOut = sum / used;
}
