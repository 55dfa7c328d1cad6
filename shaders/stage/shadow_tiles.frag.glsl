// Two parallel planes that hold all depths of a tile of 4 x 4 texels between them: what stage/shadow_bounds.frag.glsl joins
// to blocks. Tile i begins at texel 4 i - 2, so that blocks and their margins are whole tiles.
layout(location = 0) uniform ivec4 map;  // layer, unused, side of the map
layout(binding = 0) uniform sampler2DArray maps;
layout(location = 0) out vec4 planesOut;  // depth per texel along x and y; least and largest depth at the tile's middle

float storedAt(ivec2 texel) { return texelFetch(maps, ivec3(texel, map.x), 0).r; }

void main() {
    ivec2 tile = ivec2(gl_FragCoord.xy);
    ivec2 first = max(4 * tile - 2, ivec2(0));
    ivec2 last = min(4 * tile + 1, ivec2(map.z - 1));
    // Centres of texels are whole numbers here.
    vec2 middle = 4.0 * vec2(tile) - 0.5;
    // The slope between corners: exact for the surface that fills the tile, and any slope is right for others.
    float corner = storedAt(first);
    vec2 slope = vec2(storedAt(ivec2(last.x, first.y)) - corner, storedAt(ivec2(first.x, last.y)) - corner) /
                 max(vec2(last - first), vec2(1.0));
    float least = 1e30;
    float largest = -1e30;
    for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x) {
            float rest = storedAt(ivec2(x, y)) - dot(slope, vec2(x, y) - middle);
            least = min(least, rest);
            largest = max(largest, rest);
        }
    planesOut = vec4(slope, least, largest);
}
