// Between which pixels a filter over the view must stop: where surfaces are different ones, where they meet at an angle, and
// where one leaves the plane of the other by more than a share of the distance. Depth alone, even linear, would find an
// edge between any two pixels of a floor that is seen at a grazing angle.
#include "snippet/frame.glsl"
#include "snippet/view_images.glsl"
layout(binding = 11) uniform VIEW_IMAGE normals;    // world axes
layout(binding = 15) uniform VIEW_IMAGE positions;  // eye-relative world; w 0: no surface
layout(location = 0) uniform float threshold;
layout(location = 0) out float edgesOut;  // (1 to the pixel on the right, 2 to the one above, 3 both) / 255

// 37 degrees: facets of round things meet at less, walls and floors at more.
const float kSmoothCosine = 0.8;

bool isEdge(ivec2 here, ivec2 there) {
    vec4 p = texelFetch(positions, here, SAMPLE_INDEX);
    vec4 q = texelFetch(positions, there, SAMPLE_INDEX);
    if (p.w != q.w) return true;
    if (p.w == 0.0) return false;
    vec3 n = texelFetch(normals, here, SAMPLE_INDEX).xyz;
    vec3 m = texelFetch(normals, there, SAMPLE_INDEX).xyz;
    if (dot(n, m) < kSmoothCosine) return true;
    vec3 apart = q.xyz - p.xyz;
    float depth = min(abs(dot(p.xyz, frame.forward.xyz)), abs(dot(q.xyz, frame.forward.xyz)));
    return max(abs(dot(n, apart)), abs(dot(m, apart))) > threshold * depth;
}

void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    ivec2 last = ivec2(frame.region.xy + frame.region.zw - frame.wallOrigin.xy) - 1;
    float edges = 0.0;
    if (here.x < last.x && isEdge(here, here + ivec2(1, 0))) edges += 1.0;
    if (here.y < last.y && isEdge(here, here + ivec2(0, 1))) edges += 2.0;
    edgesOut = edges / 255.0;
}
