#include "snippet/lights.glsl"
#include "snippet/material.glsl"

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
    vec3 toLight = -blockLights[0].light.direction;
    passed.linear = linearOnMap(shadowAt(0), relative, toLight);
    passed.cosine = dot(faceNormal, toLight);
    passed.bias = biasOfFace(shadowAt(0), relative, passed.cosine < 0.0 ? -faceNormal : faceNormal, toLight);
#endif
#endif
}
