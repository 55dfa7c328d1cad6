#include "snippet/passed_constants.glsl"

const int kMaxLobes = 4;  // GpuMaterials

// One material: GpuMaterials::Block.
layout(std140, binding = 1) uniform MaterialBlock {
    vec4 baseColour;
    vec4 metallicRoughness;  // metallic, roughness, normal scale, occlusion strength
    vec4 emission;           // w: alpha cutoff
    vec4 specular;           // w: shininess
    vec4 ambient;            // w: the share of the colour that needs no light (Phong's original)
    vec4 uvFromTexCoord[12];
    vec4 lobes[2 * kMaxLobes];  // albedo, exponent; axes, 1 where there is a lobe
} material;
#ifdef READS_PASSED_CONSTANTS
#define MATERIAL passed  // all but what textures and lobes need
#else
#define MATERIAL material
#endif

layout(binding = 0) uniform sampler2D baseColourTexture;
layout(binding = 1) uniform sampler2D metallicRoughnessTexture;
layout(binding = 2) uniform sampler2D normalTexture;
layout(binding = 3) uniform sampler2D occlusionTexture;
layout(binding = 4) uniform sampler2D emissionTexture;
layout(binding = 5) uniform sampler2D specularTexture;

#if defined(FEATURE_TEX_COORDS0) && defined(FEATURE_TEX_COORDS1)
#define TEX_COORD(unit) (material.uvFromTexCoord[2 * (unit)].w > 0.5 ? surface.texCoords1 : surface.texCoords0)
#elif defined(FEATURE_TEX_COORDS1)
#define TEX_COORD(unit) surface.texCoords1
#elif defined(FEATURE_TEX_COORDS0)
#define TEX_COORD(unit) surface.texCoords0
#endif

vec2 transformedTexCoord(int unit, vec2 texCoord) {
    vec3 p = vec3(texCoord, 1.0);
    return vec2(dot(material.uvFromTexCoord[2 * unit].xyz, p), dot(material.uvFromTexCoord[2 * unit + 1].xyz, p));
}
#ifdef VERTEX_STAGE
// A vertex is a point and has no neighbours that would say a level: the finest.
#define SAMPLE(sampler, unit) textureLod(sampler, transformedTexCoord(unit, TEX_COORD(unit)), 0.0)
#else
#define SAMPLE(sampler, unit) texture(sampler, transformedTexCoord(unit, TEX_COORD(unit)))
#endif

vec3 specularColour() {
#ifdef FEATURE_SPECULAR_TEXTURE
    return MATERIAL.specular.rgb * SAMPLE(specularTexture, 5).rgb;
#else
    return MATERIAL.specular.rgb;
#endif
}
