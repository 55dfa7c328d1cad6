#include "formula/guard.glsl"
#include "formula/shadow.glsl"
#include "structs/standard_shadow.glsl"

// The share of a light that arrives: 1 lit, 0 in shadow (Williams 1978): one comparison with the nearest texel, by
// texelFetch, so that no driver's filter decides. Outside of the map everything is lit.
//
// relative: the surface, eye-relative world; normal: geometric, unit; toLight: unit.
float standardShadow(sampler2DArray maps, GpuStandardShadow shadow, vec3 relative, vec3 normal, vec3 toLight) {
    vec3 facing = dot(normal, toLight) < 0.0 ? -normal : normal;
    float axial = (shadow.clipFromRelative * vec4(relative, 1.0)).w;
    float texel = shadow.isPerspective > 0.5 ? shadow.texelSize * max(axial, 0.0) : shadow.texelSize;
    vec3 normalMap = vec3(dot(facing, shadow.axisX), dot(facing, shadow.axisY), 0.0);
    float largest = max(max(abs(relative.x), abs(relative.y)), abs(relative.z));
    vec3 moved = relative + facing * shadowNormalOffset(normalMap, texel, shadow.normalOffset) +
                 toLight * (shadow.constantBias * texel + shadowRoundingBias(largest));
    vec4 clip = shadow.clipFromRelative * vec4(moved, 1.0);
    if (!(clip.w > 0.0)) return 1.0;
    vec3 mapped = clip.xyz / clip.w;
    vec2 place = (mapped.xy * 0.5 + 0.5) * shadow.mapSize;
    if (!(all(greaterThanEqual(place, vec2(0.0))) && all(lessThan(place, vec2(shadow.mapSize))))) return 1.0;
    float stored = texelFetch(maps, ivec3(ivec2(place), int(shadow.layer)), 0).r;
    // Depths are reversed: what is nearer to the light is larger.
    return shadowCompare(-stored, -mapped.z);
}
