#define VERTEX_STAGE
#include "snippet/frame.glsl"
#define VARYING out
#include "snippet/surface_varyings.glsl"

#include VERTEX_SHADING
#include PASSED_CONSTANTS

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tangent;
layout(location = 3) in vec4 colour;
layout(location = 4) in vec2 texCoords0;
layout(location = 5) in vec2 texCoords1;
layout(location = 6) in uint firstTriangle;  // per draw command
layout(location = 7) in vec3 faceNormal;     // of the triangles that begin with this vertex

layout(location = 0) uniform mat4 relativeFromObject;
layout(location = 1) uniform mat3 normalFromObject;

invariant gl_Position;  // whatever else a variant computes: depths of several passes are compared

void main() {
    vec4 relative = relativeFromObject * vec4(position, 1.0);
    surface.relative = relative.xyz;
#ifdef FEATURE_VERTEX_NORMALS
    surface.normal = normalFromObject * normal;
#endif
#ifdef FEATURE_VERTEX_TANGENTS
    surface.tangent = vec4(mat3(relativeFromObject) * tangent.xyz, tangent.w);
#endif
#ifdef FEATURE_VERTEX_COLOURS
    surface.colour = colour;
#endif
#ifdef FEATURE_TEX_COORDS0
    surface.texCoords0 = texCoords0;
#endif
#ifdef FEATURE_TEX_COORDS1
    surface.texCoords1 = texCoords1;
#endif
#ifdef FEATURE_SHADOW_LIGHT_MAP
    surface.object = position;
#endif
    surface.firstTriangle = firstTriangle;
#ifdef FEATURE_FIRST_VERTEX_NORMALS
    surface.faceNormal = faceNormal;
#endif
    shadeVertex();
#ifdef FEATURE_WORLD_AXES
    passConstants(surface.relative, faceNormal);
#else
    passConstants(surface.relative, normalizeOr(normalFromObject * faceNormal, vec3(0.0, 0.0, 1.0)));
#endif
#ifdef FEATURE_UNWRAPPED
    gl_Position = frame.clipFromRelative * vec4(texCoords1, 0.0, 1.0);
#else
    gl_Position = frame.clipFromRelative * vec4(relative.xyz, 1.0);
#endif
}
