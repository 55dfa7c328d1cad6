#include "snippet/frame.glsl"
#include "snippet/view_images.glsl"
#ifdef FEATURE_ALPHA_MASK
#define VARYING in
#include "snippet/caster_holes.glsl"
#endif
layout(binding = 15) uniform VIEW_IMAGE positions;
layout(location = 4) uniform vec4 planeRelative;  // unit normal
layout(location = 5) uniform float onPlaneOnly;   // 1: surfaces off the plane stay as they are
in vec4 flattened;
layout(location = 0) out float darknessOut;

const float kFlat = 1e-4;  // of the distance: what lies so near to the plane lies on it

void main() {
#ifdef FEATURE_ALPHA_MASK
    if (isHole()) discard;
#endif
    vec4 seen = texelFetch(positions, ivec2(gl_FragCoord.xy), SAMPLE_INDEX);
    if (seen.w == 0.0) discard;
    if (onPlaneOnly > 0.5) {
        if (abs(dot(planeRelative, seen)) > kFlat * length(seen.xyz)) discard;
    } else {
        // As a polygon that lies on the plane: over all that is behind it.
        float own = dot(flattened.xyz, frame.forward.xyz) / flattened.w;
        if (own > dot(seen.xyz, frame.forward.xyz) * (1.0 + kFlat)) discard;
    }
    darknessOut = 1.0;
}
