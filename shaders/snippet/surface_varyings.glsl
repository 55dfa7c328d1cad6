// Between stage/surface.vert.glsl and the fragment stages; VARYING is `out` or `in`.
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
    flat uint firstTriangle;
} surface;
