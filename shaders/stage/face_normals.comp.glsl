#include "formula/deformation.glsl"

// The face normal of every triangle of a geometry that was deformed.
layout(local_size_x = 64) in;

layout(location = 0) uniform uint triangles;
layout(location = 1) uniform float side;  // -1: the deformation mirrors, and triangles face the other way

layout(std430, binding = 0) readonly buffer Positions { float positions[]; };
layout(std430, binding = 1) readonly buffer Indices { uint indices[]; };
layout(std430, binding = 2) writeonly buffer FaceNormals { float faceNormals[]; };

vec3 cornerAt(uint corner) {
    uint first = indices[corner] * 3u;
    return vec3(positions[first], positions[first + 1u], positions[first + 2u]);
}

void main() {
    uint triangle = gl_GlobalInvocationID.x;
    if (triangle >= triangles) return;
    vec3 normal = triangleNormal(cornerAt(triangle * 3u), cornerAt(triangle * 3u + 1u), cornerAt(triangle * 3u + 2u)) * side;
    faceNormals[triangle * 3u] = normal.x;
    faceNormals[triangle * 3u + 1u] = normal.y;
    faceNormals[triangle * 3u + 2u] = normal.z;
}
