// What shading at vertices found, by vertex: its place, then for each side the radiance that no shadow dims and what each
// light with a shadow adds. Between a pass over the vertices and one over the pixels, for surfaces that more such lights
// reach than interpolants carry.
#ifdef FEATURE_VERTEX_TABLE
layout(location = 4) uniform uvec2 vertexTableShape;  // floats of a vertex, floats of one of its sides

uint vertexPlaceAt(uint vertex) { return vertex * vertexTableShape.x; }
uint vertexRadianceAt(uint vertex, int side) { return vertexPlaceAt(vertex) + 3u + uint(side) * vertexTableShape.y; }
uint vertexTermAt(uint vertex, int side, int light) { return vertexRadianceAt(vertex, side) + 3u * uint(light + 1); }

#ifdef VERTEX_STAGE
layout(std430, binding = 4) writeonly buffer VertexTable { float vertexTable[]; };

void storeInTable(uint at, vec3 value) {
    vertexTable[at] = value.x;
    vertexTable[at + 1u] = value.y;
    vertexTable[at + 2u] = value.z;
}
#else
layout(std430, binding = 4) readonly buffer VertexTable { float vertexTable[]; };
layout(std430, binding = 6) readonly buffer TriangleCorners { uint triangleCorners[]; };

vec3 inTable(uint at) { return vec3(vertexTable[at], vertexTable[at + 1u], vertexTable[at + 2u]); }

// The corners of the pixel's triangle and what each counts for: their shares of its area, which are what an interpolant
// would have had (but where the triangle covers samples of a pixel and not its centre: interpolants extrapolate, to what
// no vertex has); all of it the first corner's where shading is flat.
void cornersOfTriangle(out uvec3 corners, out vec3 shares) {
    uint first = 3u * (surface.firstTriangle + uint(gl_PrimitiveID));
    corners = uvec3(triangleCorners[first], triangleCorners[first + 1u], triangleCorners[first + 2u]);
    shares = vec3(1.0, 0.0, 0.0);
#ifndef FEATURE_FLAT_SHADING
    vec3 origin = inTable(vertexPlaceAt(corners.x));
    vec3 u = inTable(vertexPlaceAt(corners.y)) - origin;
    vec3 v = inTable(vertexPlaceAt(corners.z)) - origin;
    vec3 p = surface.relative - origin;
    vec3 across = cross(u, v);
    float area = dot(across, across);
    if (!(area > 0.0)) return;  // seen as a line: any corner's
    vec2 part = clamp(vec2(dot(cross(p, v), across), dot(cross(u, p), across)) / area, 0.0, 1.0);
    // Rounding may leave the triangle, colours may not.
    part /= max(part.x + part.y, 1.0);
    shares = vec3(1.0 - part.x - part.y, part);
#endif
}
#endif
#endif
