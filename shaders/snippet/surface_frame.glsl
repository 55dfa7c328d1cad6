#include "formula/guard.glsl"
#include "snippet/to_eye.glsl"

layout(location = 1) uniform mat3 normalFromObject;
layout(binding = 7) uniform samplerBuffer faceNormals;

// Unit, world axes, on the side of the winding; from a table, as derivatives would differ between tiles.
vec3 faceNormalWorld() {
#ifdef FEATURE_FIRST_VERTEX_NORMALS
    vec3 normal = surface.faceNormal;
#else
    vec3 normal = texelFetch(faceNormals, int(surface.firstTriangle) + gl_PrimitiveID).xyz;
#endif
#ifdef FEATURE_WORLD_AXES
    return normal;
#else
    return normalizeOr(normalFromObject * normal, vec3(0.0, 0.0, 1.0));
#endif
}

#ifdef FEATURE_FLAT_MEAN
layout(location = 0) uniform mat4 relativeFromObject;
layout(binding = 9) uniform samplerBuffer flatFaces;  // by triangle: its centre and its mean normal, object space

// Where a triangle is shaded that has one colour, and the normal it is shaded with.
void flatFace(out vec3 relative, out vec3 normal) {
    int triangle = int(surface.firstTriangle) + gl_PrimitiveID;
    relative = (relativeFromObject * vec4(texelFetch(flatFaces, 2 * triangle).xyz, 1.0)).xyz;
    normal = normalizeOr(normalFromObject * texelFetch(flatFaces, 2 * triangle + 1).xyz, faceNormalWorld());
}
#endif
