// Shadows that were baked into an atlas (common/scene/light_map.h): a surface that stays where it is looks its factor up.
#ifdef FEATURE_SHADOW_LIGHT_MAP
layout(binding = 15) uniform sampler2DArray lightMaps;  // linear, no mips; by light and page
// By chart: u and v in texels as functions of a place in object space, and what may be looked up.
layout(std430, binding = 3) readonly buffer LightMapCharts { vec4 lightMapCharts[]; };
layout(std430, binding = 7) readonly buffer LightMapPlaces { uint lightMapPlaces[]; };  // by drawn triangle: its chart

float lightMapAt(uint shadow) {
    uint chart = lightMapPlaces[int(surface.firstTriangle) + gl_PrimitiveID];
    if (chart == kNoChart) return 1.0;
    vec4 place = vec4(surface.object, 1.0);
    vec4 range = lightMapCharts[3u * chart + 2u];
    // A pixel's middle may lie beside its triangle where there are several samples: no texel of another chart is asked.
    vec2 texel = clamp(vec2(dot(lightMapCharts[3u * chart], place), dot(lightMapCharts[3u * chart + 1u], place)),
                       range.xy, range.zw);
    float layer = shadowAt(shadow).layer;
#ifdef FEATURE_SHADOW_LIGHT_MAP_PAGES
    // LightMapPages, common/scene/light_map.h: pages share a row and a column with their neighbours.
    float stride = float(textureSize(lightMaps, 0).x - 1);
    float columns = ceil((shadowAt(shadow).mapSize - 1.0) / stride);
    vec2 page = clamp(floor((texel - 0.5) / stride), vec2(0.0), vec2(columns - 1.0));
    texel -= page * stride;
    layer = (layer * columns + page.y) * columns + page.x;
#endif
    return textureLod(lightMaps, vec3(texel / vec2(textureSize(lightMaps, 0).xy), layer), 0.0).r;
}
#endif
