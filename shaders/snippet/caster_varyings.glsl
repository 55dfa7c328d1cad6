// Between stage/caster.vert.glsl and stage/caster.frag.glsl, for casters with holes.
VARYING Surface {
    float present;  // blocks have members
#ifdef FEATURE_VERTEX_COLOURS
    float alpha;
#endif
#ifdef FEATURE_TEX_COORDS0
    vec2 texCoords0;
#endif
#ifdef FEATURE_TEX_COORDS1
    vec2 texCoords1;
#endif
} surface;
