// What is the same for all of a draw item, on its way from the vertices to the pixels. A renderer that gathers each number of a
// uniform block for each pixel by itself (llvmpipe: 28 instructions, more than half of what a surface's pixel took) reads a
// flat interpolant at once, and its vertices read a block as fast as any. Only what a fragment shader asks for is passed:
// linkers drop the rest. Constants keep their bits on the way; places on maps and the light's cosine, interpolated instead of
// computed, differ by rounding. For items that one parallel light reaches, whose shadow is one map (server/draw/gpu_scene.cpp):
// all of a shadow's records would not fit.
#ifdef FEATURE_PASSED_CONSTANTS
#ifdef VERTEX_STAGE
#define PASSED out
#else
#define PASSED in
#define READS_PASSED_CONSTANTS
#endif
#if defined(FEATURE_SHADOWS) && !defined(FEATURE_SHADOW_FILTER) && defined(FEATURE_FIRST_VERTEX_NORMALS)
#define PASSES_SHADOW_PLACE
#ifdef READS_PASSED_CONSTANTS
#define READS_SHADOW_PLACE
#endif
#endif
// What a matt surface of one colour reflects of its light is that times the cosine which the light falls at. Not beside a
// filter's plain loop, which is slower then (contact-hardening: 144 for 134 ms; the cause was not found).
#if (defined(FEATURE_LAMBERT) || defined(FEATURE_MATT)) && !defined(FEATURE_VERTEX_COLOURS) && \
    !defined(FEATURE_NORMAL_TEXTURE) && !defined(FEATURE_FLAT_MEAN) && !defined(FEATURE_LIGHT_AMBIENT) && \
    (!defined(FEATURE_SHADOW_FILTER) || defined(FEATURE_SHADOW_SKIP))
#define PASSES_MATT_LIGHT
#ifdef READS_PASSED_CONSTANTS
#define READS_MATT_LIGHT
#endif
#endif
PASSED Constants {
    flat vec4 baseColour;  // as in MaterialBlock
    flat vec4 metallicRoughness;
    flat vec4 emission;
    flat vec4 specular;
    flat vec4 ambient;
    flat vec3 ambientRadiance;
    flat vec3 direction;  // as in GpuLight
    flat vec3 irradianceOrIntensity;
    flat vec3 ambientShare;
    flat vec3 highlightShare;
    flat uint index;
#ifdef FEATURE_FIRST_VERTEX_NORMALS
    flat float cosine;  // between the face's normal and the way to the light
#endif
#ifdef PASSES_MATT_LIGHT
    flat vec3 matt;  // radiance of a texel of 1 where the light falls at right angles, before its shadow
#ifdef FEATURE_VERTEX_NORMALS
    vec3 normalToLight;  // the shading normal in axes of which z is the way to the light, of any length
#endif
#endif
#ifdef FEATURE_SHADOWS
    flat mat4 clipFromRelative;  // as in GpuShadow
    flat vec3 texelX;
    flat vec3 texelY;
    flat float warpX;
    flat float warpY;
    flat vec3 unwarp;
    flat float mapSize;
    flat float layer;
    flat float constantBias;
    flat float normalOffset;
    flat float depthScale;
    flat float depthOffset;
    flat float filterTexels;
    flat float filterMetres;
    flat float lightSize;
    flat float maxTexels;
    flat uint filterSamples;
    flat uint blockerSamples;
    flat uint boundsBlock;
    flat vec4 texelRowX;
    flat vec4 texelRowY;
    flat float depthAtEye;
    flat float offsetX;
    flat float offsetY;
    flat float depthPerMetre;
#ifdef PASSES_SHADOW_PLACE
    vec4 linear;          // of snippet/shadow_place.glsl
    flat vec4 bias;
    flat vec3 unwarpTexel;  // what GpuShadow's unwarp is for (x, y, 1) of a texel's corner, at the texel's centre
#endif
#endif
} passed;
#endif
