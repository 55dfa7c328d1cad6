// Bounds of a block of a shadow map: two parallel planes over the texels that hold all its depths between them. A surface
// that fills the block lies in both, whatever its slope, where a least and a largest depth would lie far apart. A block
// reaches kBoundsMargin texels (snippet/shadow_filter.glsl) beyond its stride on each side, so that one block answers for
// all texels of a filter.
layout(location = 0) uniform ivec4 block;  // layer, stride of blocks in texels, side of the map
layout(binding = 0) uniform sampler2DArray maps;
layout(location = 0) out vec4 boundsOut;  // depth per texel along x and y; least and largest depth at the block's middle

const int kMargin = 6;

float storedAt(vec2 texel) { return texelFetch(maps, ivec3(ivec2(texel), block.x), 0).r; }

void main() {
    ivec2 first = max(ivec2(gl_FragCoord.xy) * block.y - kMargin, ivec2(0));
    ivec2 last = min(ivec2(gl_FragCoord.xy) * block.y + block.y + kMargin, ivec2(block.z)) - 1;
    // Centres of texels are whole numbers here and halves where the planes are read.
    vec2 middle = floor(gl_FragCoord.xy) * float(block.y) + 0.5 * float(block.y) - 0.5;
    // The slope between corners: exact for the surface that fills the block, and any slope is right for others.
    float corner = storedAt(vec2(first));
    vec2 slope = vec2(storedAt(vec2(last.x, first.y)) - corner, storedAt(vec2(first.x, last.y)) - corner) /
                 max(vec2(last - first), vec2(1.0));
    float least = 1e30;
    float largest = -1e30;
    for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x) {
            float rest = storedAt(vec2(x, y)) - dot(slope, vec2(x, y) - middle);
            least = min(least, rest);
            largest = max(largest, rest);
        }
    boundsOut = vec4(slope, least, largest);
}
