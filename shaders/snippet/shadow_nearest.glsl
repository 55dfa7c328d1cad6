#include "snippet/shadow_place.glsl"

// One comparison with the nearest texel (Williams 1978), by texelFetch, so that no driver's filter decides: 1 lit, 0 in
// shadow.
float filterNearest(sampler2DArray maps, GpuShadow shadow, ShadowPlace place) {
    if (!place.isOn) return 1.0;
    float stored = texelFetch(maps, ivec3(ivec2(place.texel), int(shadow.layer)), 0).r;
    return shadowCompare(-stored, -storedAtNearest(shadow, place));
}
