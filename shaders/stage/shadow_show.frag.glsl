// What a viewport shows of how its shadows are made, in place of the scene. docs/shadows.md says what the colours mean.
#include "snippet/frame.glsl"
#include "snippet/view_images.glsl"
#include "structs/shadow.glsl"
layout(location = 0) out vec4 colourOut;

#if defined(SHOW_FACTORS)
layout(binding = 11) uniform VIEW_LAYERS darkness;
layout(location = 0) uniform int layer;

void main() {
    float dark = texelFetch(darkness, ivec3(ivec2(gl_FragCoord.xy), layer), SAMPLE_INDEX).r;
    colourOut = vec4(vec3(1.0 - clamp(dark, 0.0, 1.0)), 1.0);
}
#elif defined(SHOW_EDGES)
layout(binding = 11) uniform VIEW_IMAGE edges;  // stage/shadow_edges.frag.glsl

void main() {
    uint bits = uint(texelFetch(edges, ivec2(gl_FragCoord.xy), SAMPLE_INDEX).r * 255.0 + 0.5);
    colourOut = vec4(float(bits & 1u), float(bits >> 1), 0.0, 1.0);
}
#else
layout(std430, binding = 2) readonly buffer Shadows { GpuShadow shadows[]; };
layout(binding = 6) uniform sampler2DArray shadowMaps;
layout(binding = 11) uniform sampler2DArray seen;
layout(location = 0) uniform ivec4 cells;    // columns, rows, side in pixels, parts
layout(location = 1) uniform ivec2 corner;   // of the cells, on the wall
layout(location = 2) uniform uint record;    // of the first part

// From 1 where the map begins to 0 where it ends, linear in metres.
float nearness(GpuShadow shadow, float depth) {
    if (shadow.isPerspective < 0.5 || shadow.shape == kShadowHemisphere) return depth;
    float near = shadow.depthScale / (1.0 + shadow.depthOffset);
    float far = shadow.depthScale / shadow.depthOffset;
    return (far - shadow.depthScale / (depth + shadow.depthOffset)) / (far - near);
}

void main() {
    colourOut = vec4(0.0, 0.0, 0.0, 1.0);
    vec2 from = WALL_PIXEL - vec2(corner);
    ivec2 cell = ivec2(floor(from / float(cells.z)));
    int part = cell.x + cells.x * (cells.y - 1 - cell.y);
    if (any(lessThan(cell, ivec2(0))) || cell.x >= cells.x || cell.y >= cells.y || part >= cells.w) return;
    GpuShadow shadow = shadows[record + uint(part)];
    vec2 texel = floor((from / float(cells.z) - vec2(cell)) * shadow.mapSize);
    float stored = texelFetch(shadowMaps, ivec3(ivec2(texel), int(shadow.layer)), 0).r;
    float depth = stored / dot(shadow.unwarp, vec3((texel + 0.5) * (2.0 / shadow.mapSize) - 1.0, 1.0));
    float grey = stored > 0.0 ? clamp(nearness(shadow, depth), 0.0, 1.0) : 0.0;
#ifdef SHOW_SEEN
    bool isSeen = texelFetch(seen, ivec3(ivec2(texel), part), 0).r > 0.5;
    colourOut.rgb = 0.5 * vec3(grey) + vec3(0.0, isSeen ? 0.5 : 0.0, 0.0);
#else
    colourOut.rgb = stored > 0.0 ? vec3(grey) : vec3(0.0, 0.0, 0.25);
#endif
}
#endif
