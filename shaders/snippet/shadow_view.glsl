#include "snippet/view_images.glsl"

// Shadows that were made in the view before the surfaces: the darkness images' layer of the light, at this pixel. Of several
// samples, those of the surface at hand are averaged.
layout(binding = 11) uniform VIEW_LAYERS darkness;

float shadowFactor_view(uint layer) {
    ivec3 place = ivec3(ivec2(gl_FragCoord.xy), int(layer));  // the images are the target's twins
#ifdef SEVERAL_SAMPLES
    uint covered = uint(gl_SampleMaskIn[0]);
    float lit = 0.0;
    float count = 0.0;
    for (int i = 0; covered != 0u; ++i, covered >>= 1) {
        if ((covered & 1u) == 0u) continue;
        lit += 1.0 - clamp(texelFetch(darkness, place, i).r, 0.0, 1.0);
        count += 1.0;
    }
    return lit / count;
#else
    return 1.0 - clamp(texelFetch(darkness, place, 0).r, 0.0, 1.0);
#endif
}
