// Two parallel planes that hold all depths of a tile of 4 x 4 texels between them: what stage/shadow_bounds.frag.glsl joins
// to blocks. Tile i begins at texel 4 i - 2, so that blocks and their margins are whole tiles.
layout(location = 0) uniform ivec4 map;  // layer, unused, side of the map
layout(binding = 0, r32f) uniform readonly imageBuffer copies;  // as in snippet/shadow_filter.glsl
layout(location = 0) out vec4 planesOut;  // depth per texel along x and y; least and largest depth at the tile's middle

void main() {
    ivec2 tile = ivec2(gl_FragCoord.xy);
    float stored[16];
    ivec2 places[4];  // beyond the map its border's texels stand again
    for (int i = 0; i < 4; ++i) places[i] = clamp(4 * tile + (i - 2), ivec2(0), ivec2(map.z - 1));
    for (int y = 0; y < 4; ++y) {
        int row = (map.x * map.z + places[y].y) * map.z;
        for (int x = 0; x < 4; ++x) stored[4 * y + x] = imageLoad(copies, row + places[x].x).r;
    }
    // Centres of texels are whole numbers here.
    vec2 middle = 4.0 * vec2(tile) - 0.5;
    // The slope between corners: exact for the surface that fills the tile, and any slope is right for others.
    vec2 slope = vec2(stored[3] - stored[0], stored[12] - stored[0]) / max(vec2(places[3] - places[0]), vec2(1.0));
    float least = 1e30;
    float largest = -1e30;
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
            float rest = stored[4 * y + x] - dot(slope, vec2(places[x].x, places[y].y) - middle);
            least = min(least, rest);
            largest = max(largest, rest);
        }
    planesOut = vec4(slope, least, largest);
}
