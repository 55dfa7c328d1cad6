#include "formula/deformation.glsl"
#include "structs/deformation.glsl"

// Morphs and skins the vertices of one geometry, once for all passes, tiles and views. Arrays of floats, because vec3
// would be padded.
layout(local_size_x = 64) in;

layout(location = 0) uniform uvec4 counts;  // vertices, morph targets, first float of rest normals and tangents

layout(std430, binding = 0) readonly buffer Rest { float rest[]; };
layout(std430, binding = 1) readonly buffer Influences { GpuInfluence influences[]; };
layout(std430, binding = 2) readonly buffer Joints { GpuJoint joints[]; };
layout(std430, binding = 3) readonly buffer Morphs { float morphs[]; };  // target after target: what each rest value gains
layout(std430, binding = 4) readonly buffer MorphWeights { float morphWeights[]; };
layout(std430, binding = 5) writeonly buffer Positions { float positions[]; };
layout(std430, binding = 6) writeonly buffer Normals { float normals[]; };
layout(std430, binding = 7) writeonly buffer Tangents { float tangents[]; };

vec3 restAt(uint first) {
    return vec3(rest[first], rest[first + 1u], rest[first + 2u]);
}

// A rest value with its morphs; `floats` is how many one target has.
vec3 morphed(uint restFirst, uint morphFirst, uint floats) {
    vec3 value = restAt(restFirst);
#ifdef DEFORM_MORPHS
    for (uint t = 0u; t < counts.y; ++t) {
        float weight = morphWeights[t];
        if (weight == 0.0) continue;
        uint first = t * floats + morphFirst;
        value += vec3(morphs[first], morphs[first + 1u], morphs[first + 2u]) * weight;
    }
#endif
    return value;
}

#ifdef DEFORM_SKIN
AffineMap mapOf(GpuJoint joint) {
    AffineMap map;
    map.x = joint.x.xyz;
    map.y = joint.y.xyz;
    map.z = joint.z.xyz;
    map.origin = joint.origin.xyz;
    return map;
}
#endif

void main() {
    uint vertex = gl_GlobalInvocationID.x;
    if (vertex >= counts.x) return;
    uint floats = counts.x * 3u;
#ifdef DEFORM_NORMALS
    floats += counts.x * 3u;
#endif
#ifdef DEFORM_TANGENTS
    floats += counts.x * 3u;
#endif
    vec3 position = morphed(vertex * 3u, vertex * 3u, floats);
#ifdef DEFORM_SKIN
    GpuInfluence influence = influences[vertex];
    AffineMap map = weightedMap(mapOf(joints[influence.joints.x]), influence.weights.x);
    if (influence.weights.y > 0.0) map = sumOfMaps(map, weightedMap(mapOf(joints[influence.joints.y]), influence.weights.y));
    if (influence.weights.z > 0.0) map = sumOfMaps(map, weightedMap(mapOf(joints[influence.joints.z]), influence.weights.z));
    if (influence.weights.w > 0.0) map = sumOfMaps(map, weightedMap(mapOf(joints[influence.joints.w]), influence.weights.w));
    position = mappedPoint(map, position);
#endif
    positions[vertex * 3u] = position.x;
    positions[vertex * 3u + 1u] = position.y;
    positions[vertex * 3u + 2u] = position.z;
#ifdef DEFORM_NORMALS
    vec3 restNormal = restAt(counts.z + vertex * 3u);
    vec3 normal = normalizeOr(morphed(counts.z + vertex * 3u, counts.z + vertex * 3u, floats), restNormal);
#ifdef DEFORM_SKIN
    normal = mappedSurfaceNormal(map, normal);
#endif
    normals[vertex * 3u] = normal.x;
    normals[vertex * 3u + 1u] = normal.y;
    normals[vertex * 3u + 2u] = normal.z;
#endif
#ifdef DEFORM_TANGENTS
    // Four floats at rest, three of which can move.
    uint first = counts.w + vertex * 4u;
    vec3 tangent = morphed(first, counts.w + vertex * 3u, floats);
#ifdef DEFORM_SKIN
    tangent = mappedDirection(map, tangent);
#endif
    tangent = normalizeOr(tangent, restAt(first));
    tangents[vertex * 4u] = tangent.x;
    tangents[vertex * 4u + 1u] = tangent.y;
    tangents[vertex * 4u + 2u] = tangent.z;
    tangents[vertex * 4u + 3u] = rest[first + 3u];
#endif
}
