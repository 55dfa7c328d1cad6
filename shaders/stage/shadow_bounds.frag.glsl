// Bounds of a block of a shadow map: two parallel planes over the texels that hold all its depths between them. A surface
// that fills the block lies in both, whatever its slope, where a least and a largest depth would lie far apart. A block
// reaches kBoundsMargin texels (snippet/shadow_filter.glsl) beyond its stride on each side, so that one block answers for
// all texels of a filter. Joined from tiles (stage/shadow_tiles.frag.glsl), whose planes stand for their texels.
layout(location = 0) uniform ivec4 block;  // unused, stride of blocks in texels (a multiple of 4), tiles along the map
layout(binding = 0) uniform sampler2D tiles;
layout(location = 0) out vec4 boundsOut;  // depth per texel along x and y; least and largest depth at the block's middle

const int kMargin = 6;  // so blocks begin with a tile, at 4 i - 2

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy);
    ivec2 first = (place * block.y - kMargin + 2) / 4;
    ivec2 last = first + (block.y + 2 * kMargin) / 4 - 1;
    // Centres of texels are whole numbers here and halves where the planes are read.
    vec2 middle = vec2(place * block.y) + 0.5 * float(block.y) - 0.5;
    ivec2 most = ivec2(block.z - 1);
    vec2 slope = texelFetch(tiles, clamp((first + last + 1) / 2, ivec2(0), most), 0).xy;
    float least = 1e30;
    float largest = -1e30;
    for (int y = max(first.y, 0); y <= min(last.y, most.y); ++y)
        for (int x = max(first.x, 0); x <= min(last.x, most.x); ++x) {
            vec4 tile = texelFetch(tiles, ivec2(x, y), 0);
            // The tile's texels lie within 1.5 of its middle.
            float tilt = 1.5 * (abs(tile.x - slope.x) + abs(tile.y - slope.y));
            float rest = dot(slope, 4.0 * vec2(x, y) - 0.5 - middle);
            least = min(least, tile.z - tilt - rest);
            largest = max(largest, tile.w + tilt - rest);
        }
    boundsOut = vec4(slope, least, largest);
}
