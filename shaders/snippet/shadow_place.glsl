#include "formula/guard.glsl"
#include "formula/shadow.glsl"
#include "structs/shadow.glsl"

// Where a surface lies on a shadow map, moved by the biases so that it does not shadow itself; the same for every module
// with maps.
struct ShadowPlace {
    vec2 texel;      // in texels from the map's corner
    float stored;    // what the map would hold there for this surface: depths are reversed, nearer is larger
    vec2 slope;      // how that changes over the surface's plane, per texel
    float depth;     // stored without the warp
    float distance;  // from the light along its axis, metres; of a directional light, from where maps begin
    vec2 texelMetres;   // the lengths of the texel's sides across the light
    bool isOn;       // false: beyond the map, where everything is lit
};

// A filter follows the surface's plane no further than this: where the light grazes (0.1: 84 degrees), the plane's depth
// changes so fast over texels that it would run through what stands on it.
const float kLeastFacing = 0.1;

#ifdef FEATURE_SHADOW_PERSPECTIVE
// The place across the light of a point relative to shadow.origin, and the scale that texels grow with.
vec3 acrossLight(GpuShadow shadow, vec3 fromOrigin, out float scale) {
    float axial = dot(fromOrigin, shadow.axisZ);
    scale = shadow.isPerspective > 0.5 ? max(-axial, 0.0) : 1.0;
    return fromOrigin - axial * shadow.axisZ;
}

// The sides of the texel at a place, metres across the light, world axes.
void texelSides(GpuShadow shadow, vec3 relative, vec3 toLight, out vec3 sideX, out vec3 sideY) {
    float scale;
    vec3 across = acrossLight(shadow, relative - shadow.origin, scale);
    sideX = shadow.texelX * scale;
    sideY = shadow.texelY * scale;
#ifdef FEATURE_SHADOW_WARP
    // w over the scale is 1 / dot(unwarp, m).
    float widening = (shadow.clipFromRelative * vec4(relative, 1.0)).w / max(scale, 1e-30);
    sideX = (sideX - across * shadow.warpX) * widening;
    sideY = (sideY - across * shadow.warpY) * widening;
#endif
}
#else
// The same of a parallel map: the inverse of how the map's coordinates change across the light, from the matrix that the
// lookup loads anyway.
void texelSides(GpuShadow shadow, vec3 relative, vec3 toLight, out vec3 sideX, out vec3 sideY) {
    mat4 m = shadow.clipFromRelative;
    vec4 clip = m * vec4(relative, 1.0);
    vec3 rowW = vec3(m[0][3], m[1][3], m[2][3]);
    vec3 alongX = vec3(m[0][0], m[1][0], m[2][0]) - (clip.x / clip.w) * rowW;
    vec3 alongY = vec3(m[0][1], m[1][1], m[2][1]) - (clip.y / clip.w) * rowW;
    float perTexel = 2.0 * clip.w / (shadow.mapSize * dot(toLight, cross(alongX, alongY)));
    sideX = cross(alongY, toLight) * perTexel;
    sideY = cross(toLight, alongX) * perTexel;
}
#endif

float largestOf(vec3 v) { return max(max(abs(v.x), abs(v.y)), abs(v.z)); }

// relative moved by the biases, for a texel with these sides (metres, world axes): towards the light alone, so that its
// place on the map stays.
vec3 movedByBiases(GpuShadow shadow, vec3 relative, vec3 facing, vec3 toLight, vec3 texelX, vec3 texelY) {
    float longer = sqrt(max(dot(texelX, texelX), dot(texelY, texelY)));
    float height =
        shadowNormalOffset(vec3(dot(facing, texelX), dot(facing, texelY), 0.0), 1.0, shadow.normalOffset);
    float towards = shadowOffsetToLight(height, dot(facing, toLight));
#ifdef FEATURE_SHADOW_PERSPECTIVE
    // Not to the lamp, nor past it.
    if (shadow.isPerspective > 0.5) towards = min(towards, 0.5 * length(relative - shadow.origin));
#endif
    return relative +
           toLight * (towards + shadow.constantBias * longer + shadowRoundingBias(largestOf(relative)));
}

// A step of a texel's side on the surface's plane: the side, and as far along the light as brings it back to the plane.
vec3 stepOnPlane(vec3 side, vec3 facing, vec3 toLight) {
    return side - toLight * (dot(facing, side) / max(dot(facing, toLight), kLeastFacing));
}

#ifdef FEATURE_SHADOW_HEMISPHERES
ShadowPlace placeOnHemisphere(GpuShadow shadow, vec3 relative, vec3 facing, vec3 toLight) {
    ShadowPlace place;
    float perTexel = length(shadow.texelX);
    vec3 axisX = shadow.texelX / perTexel;
    vec3 axisY = shadow.texelY / perTexel;
    float far = length(relative - shadow.origin);
    vec3 d = -toLight;
    vec2 t = vec2(dot(d, axisX), dot(d, axisY)) / (1.0 - dot(d, shadow.axisZ));
    // The inverse of the stereographic projection, differentiated: sides of a texel on the sphere around the light.
    float q = 1.0 + dot(t, t);
    vec3 sideX = (axisX * (2.0 / q - 4.0 * t.x * t.x / (q * q)) - axisY * (4.0 * t.x * t.y / (q * q)) +
                  shadow.axisZ * (4.0 * t.x / (q * q))) * (far * perTexel);
    vec3 sideY = (axisY * (2.0 / q - 4.0 * t.y * t.y / (q * q)) - axisX * (4.0 * t.x * t.y / (q * q)) +
                  shadow.axisZ * (4.0 * t.y / (q * q))) * (far * perTexel);
    vec3 moved = movedByBiases(shadow, relative, facing, toLight, sideX, sideY) - shadow.origin;
    float movedFar = length(moved);
    d = moved / max(movedFar, 1e-30);
    t = vec2(dot(d, axisX), dot(d, axisY)) / max(1.0 - dot(d, shadow.axisZ), 1e-3);
    place.texel = t / perTexel + 0.5 * shadow.mapSize;
    place.stored = (shadow.depthOffset - movedFar) / shadow.depthScale;
    place.slope = vec2(0.0);
    place.distance = movedFar;
    place.texelMetres = vec2(length(sideX));
    place.isOn = all(greaterThanEqual(place.texel, vec2(0.0))) && all(lessThan(place.texel, vec2(shadow.mapSize)));
    return place;
}
#endif

// The distance from the light along its axis of what is stored at the map coordinates of a texel.
float distanceOf(GpuShadow shadow, float stored, vec2 texel) {
    float depth = stored;
#ifdef FEATURE_SHADOW_WARP
    depth /= dot(shadow.unwarp, vec3(texel * (2.0 / shadow.mapSize) - 1.0, 1.0));
#endif
#ifdef FEATURE_SHADOW_PERSPECTIVE
    if (shadow.isPerspective > 0.5) return shadow.depthScale / (depth + shadow.depthOffset);
#endif
    return shadow.depthOffset - shadow.depthScale * depth;
}

#if !defined(FEATURE_SHADOW_PERSPECTIVE) && !(defined(FEATURE_SHADOW_WARP) && defined(FEATURE_SHADOW_FILTER))
#define PARALLEL_SHADOW_PLACE
// The general function below for parallel lights, in two steps that interpolants may part: towards such a light a surface
// keeps its place on the map, so that all but the division by w is linear in the place or the same all over a face.

vec4 rowOfW(GpuShadow shadow) {
    return vec4(shadow.clipFromRelative[0][3], shadow.clipFromRelative[1][3], shadow.clipFromRelative[2][3],
                shadow.clipFromRelative[3][3]);
}

// Linear in the place, and 0 at the eye: texels (times w) from where the eye is, undistorted depth, w.
vec4 linearOnMap(GpuShadow shadow, vec3 relative, vec3 toLight) {
    vec4 linear = vec4(dot(shadow.texelRowX.xyz, relative), dot(shadow.texelRowY.xyz, relative),
                       shadow.depthPerMetre * dot(toLight, relative), 0.0);
#ifdef FEATURE_SHADOW_WARP
    linear.w = dot(rowOfW(shadow).xyz, relative);
#endif
    return linear;
}

// The bias of a face that looks to the light, in undistorted depth: x, or on a warped map, for depth z of linearOnMap(),
// w (|x + y z| + |z + w z|), as the sides of texels are linear in the place across the light, times w.
vec4 biasOfFace(GpuShadow shadow, vec3 onFace, vec3 facing, vec3 toLight) {
    float cosine = dot(facing, toLight);
#ifdef FEATURE_SHADOW_WARP
    float perHeight = shadow.depthPerMetre * shadowOffsetToLight(shadow.normalOffset, cosine);
    float height = dot(facing, onFace);
    vec2 warp = vec2(shadow.warpX, shadow.warpY);
    vec2 still = perHeight * (vec2(dot(facing, shadow.texelX), dot(facing, shadow.texelY)) - warp * height);
    vec2 perDepth = (perHeight * cosine / shadow.depthPerMetre) * warp;
    return vec4(still.x, perDepth.x, still.y, perDepth.y);
#else
    float height = abs(dot(shadow.texelRowX.xyz, facing)) * shadow.offsetX +
                   abs(dot(shadow.texelRowY.xyz, facing)) * shadow.offsetY;
    return vec4(shadow.depthPerMetre * shadowOffsetToLight(height, cosine), 0.0, 0.0, 0.0);
#endif
}

ShadowPlace placeOnParallelMap(GpuShadow shadow, vec4 linear, vec4 bias) {
    ShadowPlace place;
    place.texel = linear.xy + vec2(shadow.texelRowX.w, shadow.texelRowY.w);
    place.depth = linear.z + shadow.depthAtEye;
#ifdef FEATURE_SHADOW_WARP
    float w = linear.w + rowOfW(shadow).w;
    place.texel *= 1.0 / w;
    place.depth += w * (abs(bias.x + bias.y * linear.z) + abs(bias.z + bias.w * linear.z));
#else
    const float w = 1.0;
    place.depth += bias.x;
#endif
    place.stored = place.depth;
    // Written so that NaN is off the map.
    place.isOn = w > 0.0 && all(greaterThanEqual(place.texel, vec2(0.0))) &&
                 all(lessThan(place.texel, vec2(shadow.mapSize)));
    place.slope = vec2(0.0);
    return place;
}
#endif

// relative: the surface, eye-relative world; normal: geometric, unit; toLight: unit.
ShadowPlace placeOnShadowMap(GpuShadow shadow, vec3 relative, vec3 normal, vec3 toLight) {
    vec3 facing = dot(normal, toLight) < 0.0 ? -normal : normal;
#ifdef FEATURE_SHADOW_HEMISPHERES
    if (shadow.shape == kShadowHemisphere) return placeOnHemisphere(shadow, relative, facing, toLight);
#endif
#ifdef PARALLEL_SHADOW_PLACE
    ShadowPlace place = placeOnParallelMap(shadow, linearOnMap(shadow, relative, toLight),
                                           biasOfFace(shadow, relative, facing, toLight));
#ifdef FEATURE_SHADOW_FILTER
    vec2 sides = vec2(dot(facing, shadow.texelX), dot(facing, shadow.texelY));
    place.slope = -sides * (shadow.depthPerMetre / max(dot(facing, toLight), kLeastFacing));
    place.texelMetres = vec2(length(shadow.texelX), length(shadow.texelY));
    place.distance = distanceOf(shadow, place.stored, place.texel);
#endif
    return place;
#else
    ShadowPlace place;
    vec3 sideX;
    vec3 sideY;
    texelSides(shadow, relative, toLight, sideX, sideY);
    vec4 clip = shadow.clipFromRelative * vec4(movedByBiases(shadow, relative, facing, toLight, sideX, sideY), 1.0);
    vec3 mapped = clip.xyz / clip.w;
    place.texel = (mapped.xy * 0.5 + 0.5) * shadow.mapSize;
    place.stored = mapped.z;
    // w over the scale, again, now of the moved place.
#ifdef FEATURE_SHADOW_PERSPECTIVE
    place.depth = mapped.z / dot(shadow.unwarp, vec3(mapped.xy, 1.0));
#else
    place.depth = clip.z;
#endif
    // Written so that NaN is off the map.
    place.isOn = clip.w > 0.0 && all(greaterThanEqual(place.texel, vec2(0.0))) &&
                 all(lessThan(place.texel, vec2(shadow.mapSize)));
    place.slope = vec2(0.0);
#ifdef FEATURE_SHADOW_FILTER
    // A plane in the world is a plane on the map, warped or not: what it stores is linear in the texel.
    vec4 stepX = shadow.clipFromRelative * vec4(stepOnPlane(sideX, facing, toLight), 0.0);
    vec4 stepY = shadow.clipFromRelative * vec4(stepOnPlane(sideY, facing, toLight), 0.0);
    place.slope = vec2(stepX.z - mapped.z * stepX.w, stepY.z - mapped.z * stepY.w) / clip.w;
    place.texelMetres = vec2(length(sideX), length(sideY));
    place.distance = distanceOf(shadow, place.stored, place.texel);
#endif
    return place;
#endif
}

// What the map would hold at the nearest texel's centre for a surface that stays at the place's distance across the texel:
// under a warp that is not what it would hold at the place itself.
float storedAtNearest(GpuShadow shadow, ShadowPlace place) {
#if defined(FEATURE_SHADOW_WARP) && defined(READS_SHADOW_PLACE)
    return place.depth * dot(passed.unwarpTexel, vec3(floor(place.texel), 1.0));
#elif defined(FEATURE_SHADOW_WARP)
    vec2 centre = (floor(place.texel) + 0.5) * (2.0 / shadow.mapSize) - 1.0;
    return place.depth * dot(shadow.unwarp, vec3(centre, 1.0));
#else
    return place.stored;
#endif
}
