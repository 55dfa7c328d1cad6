#include "snippet/shadow_place.glsl"

// One comparison with the nearest texel (Williams 1978), by texelFetch, so that no driver's filter decides: 1 lit, 0 in
// shadow.
float filterNearest(sampler2DArray maps, GpuShadow shadow, vec3 relative, vec3 normal, vec3 toLight) {
    ShadowPlace place = placeOnShadowMap(shadow, relative, normal, toLight, 0.0);
    if (!place.isOn) return 1.0;
    ivec2 texel = ivec2(place.texel);
    float stored = texelFetch(maps, ivec3(texel, int(shadow.layer)), 0).r;
    // Depths are reversed: what is nearer to the light is larger.
    return shadowCompare(-stored, -storedDepthAt(shadow, place, vec2(texel) + 0.5));
}
