// Marks on a light's map what the visible surfaces read of it: a point for each pixel, where its lookup falls, as wide as its
// filter.
#include "snippet/frame.glsl"
#include "snippet/view_images.glsl"
#include "snippet/shadow_place.glsl"
#include "snippet/light_part.glsl"
layout(std430, binding = 2) readonly buffer Shadows { GpuShadow shadows[]; };
layout(binding = 11) uniform VIEW_IMAGE normals;
layout(binding = 15) uniform VIEW_IMAGE positions;
layout(location = 0) uniform ivec4 area;    // in the target's pixels: x, y, width, height
layout(location = 1) uniform uvec2 record;  // of the light's first part; the part
layout(location = 2) uniform float width;   // texels of a lookup from side to side

void main() {
    gl_PointSize = 1.0;
    gl_Position = vec4(2.0, 2.0, 0.0, 1.0);  // not on the map
    ivec2 pixel = area.xy + ivec2(gl_VertexID % area.z, gl_VertexID / area.z);
    vec4 surface = texelFetch(positions, pixel, 0);
    if (surface.w == 0.0) return;
    vec3 normal = texelFetch(normals, pixel, 0).xyz;
    GpuShadow first = shadows[record.x];
    bool isAround = first.shape == kShadowCube || first.shape == kShadowHemisphere;
    vec3 fromLight = surface.xyz - first.origin;
    vec3 toLight = isAround || first.isPerspective > 0.5 ? normalizeOr(-fromLight, first.axisZ) : first.axisZ;
    if (dot(normal, toLight) <= 0.0) return;  // unlit: no map is asked
    if (first.shape == kShadowCube && cubeFaceOf(fromLight) != record.y) return;
    if (first.shape == kShadowHemisphere && hemisphereOf(fromLight, first.axisZ) != record.y) return;
    GpuShadow shadow = shadows[record.x + record.y];
    ShadowPlace place = placeOnShadowMap(shadow, surface.xyz, normal, toLight);
    if (!place.isOn) return;
    vec2 at = width > 1.0 ? place.texel : floor(place.texel) + 0.5;
    gl_PointSize = width;
    gl_Position = vec4(at / shadow.mapSize * 2.0 - 1.0, 0.0, 1.0);
}
