#include "formula/guard.glsl"
#include "formula/shadow.glsl"
#include "structs/shadow.glsl"

// Where a surface lies on a shadow map, moved by the biases so that it does not shadow itself; the same for every module
// with maps. spread: the filter's reach in texels beyond the nearest texel.
struct ShadowPlace {
    vec2 texel;     // in texels from the map's corner
    float depth;    // undistorted, 1 nearest the light
    float unwarp;   // stored depth of this depth = depth * unwarp
    vec3 perTexelX; // metres across the light per texel, world axes
    vec3 perTexelY;
    bool isOn;      // false: beyond the map, where everything is lit
};

// The place across the light of a point relative to shadow.origin, and the scale that texels grow with.
vec3 acrossLight(GpuShadow shadow, vec3 fromOrigin, out float scale) {
    float axial = dot(fromOrigin, shadow.axisZ);
    scale = shadow.isPerspective > 0.5 ? max(-axial, 0.0) : 1.0;
    return fromOrigin - axial * shadow.axisZ;
}

// relative: the surface, eye-relative world; normal: geometric, unit; toLight: unit.
ShadowPlace placeOnShadowMap(GpuShadow shadow, vec3 relative, vec3 normal, vec3 toLight, float spread) {
    ShadowPlace place;
    vec3 facing = dot(normal, toLight) < 0.0 ? -normal : normal;
    float scale;
    vec3 across = acrossLight(shadow, relative - shadow.origin, scale);
    place.perTexelX = shadow.texelX * scale;
    place.perTexelY = shadow.texelY * scale;
#ifdef FEATURE_SHADOW_WARP
    vec4 unmoved = shadow.clipFromRelative * vec4(relative, 1.0);
    // w over the scale is 1 / unwarp.
    float widening = unmoved.w / max(scale, 1e-30);
    place.perTexelX = (place.perTexelX - across * shadow.warpX) * widening;
    place.perTexelY = (place.perTexelY - across * shadow.warpY) * widening;
#endif
    vec3 normalMap = vec3(dot(facing, place.perTexelX), dot(facing, place.perTexelY), 0.0);
    float texel = sqrt(max(dot(place.perTexelX, place.perTexelX), dot(place.perTexelY, place.perTexelY)));
    float largest = max(max(abs(relative.x), abs(relative.y)), abs(relative.z));
    vec3 moved = relative + facing * shadowNormalOffset(normalMap, 1.0, shadow.normalOffset + spread) +
                 toLight * (shadow.constantBias * texel + shadowRoundingBias(largest));
    vec4 clip = shadow.clipFromRelative * vec4(moved, 1.0);
    vec3 mapped = clip.xyz / clip.w;
    place.depth = mapped.z;
    place.unwarp = 1.0;
#ifdef FEATURE_SHADOW_WARP
    acrossLight(shadow, moved - shadow.origin, scale);
    place.depth = clip.z / scale;
#endif
    place.texel = (mapped.xy * 0.5 + 0.5) * shadow.mapSize;
    // Written so that NaN is off the map.
    place.isOn = clip.w > 0.0 && all(greaterThanEqual(place.texel, vec2(0.0))) &&
                 all(lessThan(place.texel, vec2(shadow.mapSize)));
    return place;
}

// What the map would hold at a texel for the place's depth.
float storedDepthAt(GpuShadow shadow, ShadowPlace place, vec2 texelCentre) {
#ifdef FEATURE_SHADOW_WARP
    vec2 m = texelCentre * (2.0 / shadow.mapSize) - 1.0;
    return place.depth * dot(shadow.unwarp, vec3(m, 1.0));
#else
    return place.depth;
#endif
}
