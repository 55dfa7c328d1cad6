#include "formula/deformation.glsl"

// The face normal of every triangle of a geometry that was deformed.
layout(local_size_x = 64) in;

layout(location = 0) uniform uint triangles;
layout(location = 1) uniform float side;  // -1: the deformation mirrors, and triangles face the other way

layout(std430, binding = 0) readonly buffer Positions { float positions[]; };
layout(std430, binding = 1) readonly buffer Indices { uint indices[]; };
layout(std430, binding = 2) writeonly buffer FaceNormals { float faceNormals[]; };
#ifdef DEFORM_FLAT_FACES
layout(std430, binding = 3) readonly buffer Normals { float normals[]; };
layout(std430, binding = 4) writeonly buffer FlatFaces { float flatFaces[]; };

// The mean of a vertex value over a triangle's corners; `values` is one of the arrays above.
#define MEAN_OF(values)                                                                                              \
    (vec3(values[corner.x], values[corner.x + 1u], values[corner.x + 2u]) +                                          \
     vec3(values[corner.y], values[corner.y + 1u], values[corner.y + 2u]) +                                          \
     vec3(values[corner.z], values[corner.z + 1u], values[corner.z + 2u])) / 3.0
#endif

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
#ifdef DEFORM_FLAT_FACES
    uvec3 corner = uvec3(indices[triangle * 3u], indices[triangle * 3u + 1u], indices[triangle * 3u + 2u]) * 3u;
    vec3 centre = MEAN_OF(positions);
    vec3 mean = MEAN_OF(normals);
    for (uint i = 0u; i < 3u; ++i) {
        flatFaces[triangle * 6u + i] = centre[i];
        flatFaces[triangle * 6u + 3u + i] = mean[i];
    }
#endif
}
