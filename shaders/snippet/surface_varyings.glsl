// Between stage/surface.vert.glsl and the fragment stages; VARYING is `out` or `in`.
#if defined(FEATURE_VERTEX_SHADING) && !defined(FEATURE_VERTEX_TABLE)
#define INTERPOLATES_RADIANCE
const int kShadowedLights = 4;  // kVertexShadows of server/draw
#ifdef FEATURE_FLAT_SHADING
#define SHADED flat  // the colour of a triangle's first vertex
#else
#define SHADED smooth
#endif
#endif
VARYING Surface {
    vec3 relative;
#ifdef FEATURE_VERTEX_NORMALS
    vec3 normal;
#endif
#ifdef FEATURE_VERTEX_TANGENTS
    vec4 tangent;
#endif
#ifdef FEATURE_VERTEX_COLOURS
    vec4 colour;
#endif
#ifdef FEATURE_TEX_COORDS0
    vec2 texCoords0;
#endif
#ifdef FEATURE_TEX_COORDS1
    vec2 texCoords1;
#endif
#ifdef FEATURE_SHADOW_LIGHT_MAP
    vec3 object;  // the place in object space
#endif
    flat uint firstTriangle;
#ifdef FEATURE_FIRST_VERTEX_NORMALS
    flat vec3 faceNormal;
#endif
#ifdef INTERPOLATES_RADIANCE
    SHADED vec3 radiance;
#ifdef FEATURE_SHADOWS
    SHADED vec3 shadowed[kShadowedLights];  // of each light with a shadow, before it
#endif
#ifdef FEATURE_DOUBLE_SIDED
    SHADED vec3 radianceBehind;
#ifdef FEATURE_SHADOWS
    SHADED vec3 shadowedBehind[kShadowedLights];
#endif
#endif
#endif
} surface;
