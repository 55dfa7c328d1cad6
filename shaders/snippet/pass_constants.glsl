#include "formula/normal_map.glsl"
#include "snippet/surface_colour.glsl"
#include REFLECTION_MODEL
#include "snippet/light_sum.glsl"

// A normal whose squares float can hold.
vec3 withinSquares(vec3 normal) {
    float largest = max(max(abs(normal.x), abs(normal.y)), abs(normal.z));
    return largest < 1e9 && largest > 1e-9 ? normal : normalizeOr(normal, vec3(0.0));
}

// Of the vertices: what snippet/passed_constants.glsl hands on. faceNormal: of the triangles that begin with the vertex, unit,
// world axes.
void passConstants(vec3 relative, vec3 faceNormal) {
    passed.baseColour = material.baseColour;
    passed.metallicRoughness = material.metallicRoughness;
    passed.emission = material.emission;
    passed.specular = material.specular;
    passed.ambient = material.ambient;
    passed.ambientRadiance = ambientRadiance;
    passed.direction = blockLights[0].light.direction;
    passed.irradianceOrIntensity = blockLights[0].light.irradianceOrIntensity;
    passed.ambientShare = blockLights[0].light.ambientShare;
    passed.highlightShare = blockLights[0].light.highlightShare;
    passed.index = blockLights[0].light.index;
    vec3 toLight = -blockLights[0].light.direction;
#ifdef FEATURE_FIRST_VERTEX_NORMALS
    passed.cosine = dot(faceNormal, toLight);
    vec3 facing = passed.cosine < 0.0 ? -faceNormal : faceNormal;
#endif
#ifdef PASSES_MATT_LIGHT
#ifdef FEATURE_VERTEX_NORMALS
    passed.normalToLight = inFrameAlong(toLight, withinSquares(surface.normal));
#endif
    // Matt: the same from wherever the eye looks.
    vec3 unshadowed = vec3(0.0);
    passed.matt = lightTerm(lightAt(0), reflectionOf(material.baseColour.rgb, vec3(1.0)), relative, toLight, toLight,
                            toLight, unshadowed);
#endif
#ifdef FEATURE_SHADOWS
    passed.clipFromRelative = shadowAt(0).clipFromRelative;
    passed.texelX = shadowAt(0).texelX;
    passed.texelY = shadowAt(0).texelY;
    passed.warpX = shadowAt(0).warpX;
    passed.warpY = shadowAt(0).warpY;
    passed.unwarp = shadowAt(0).unwarp;
    passed.mapSize = shadowAt(0).mapSize;
    passed.layer = shadowAt(0).layer;
    passed.constantBias = shadowAt(0).constantBias;
    passed.normalOffset = shadowAt(0).normalOffset;
    passed.depthScale = shadowAt(0).depthScale;
    passed.depthOffset = shadowAt(0).depthOffset;
    passed.filterTexels = shadowAt(0).filterTexels;
    passed.filterMetres = shadowAt(0).filterMetres;
    passed.lightSize = shadowAt(0).lightSize;
    passed.maxTexels = shadowAt(0).maxTexels;
    passed.filterSamples = shadowAt(0).filterSamples;
    passed.blockerSamples = shadowAt(0).blockerSamples;
    passed.boundsBlock = shadowAt(0).boundsBlock;
    passed.texelRowX = shadowAt(0).texelRowX;
    passed.texelRowY = shadowAt(0).texelRowY;
    passed.depthAtEye = shadowAt(0).depthAtEye;
    passed.offsetX = shadowAt(0).offsetX;
    passed.offsetY = shadowAt(0).offsetY;
    passed.depthPerMetre = shadowAt(0).depthPerMetre;
#ifdef PASSES_SHADOW_PLACE
    float perTexel = 2.0 / shadowAt(0).mapSize;
    vec3 unwarp = shadowAt(0).unwarp;
    passed.unwarpTexel = vec3(unwarp.xy * perTexel, unwarp.z + (unwarp.x + unwarp.y) * (0.5 * perTexel - 1.0));
    passed.linear = linearOnMap(shadowAt(0), relative, toLight);
    passed.bias = biasOfFace(shadowAt(0), relative, facing, toLight);
#endif
#endif
}
