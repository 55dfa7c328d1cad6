#ifndef __cplusplus
#include "formula/fresnel.glsl"
#include "formula/ggx.glsl"
#include "formula/lambert.glsl"
#endif

// The material of glTF 2.0, appendix B.3: a dielectric (diffuse below a coat of reflectance 0.04) and a metal, mixed.
//
// It is reciprocal. Each of its two lobes gives back at most what it gets, but their sum is glTF's simple mix: at
// grazing angles it reflects more (README.md says how much), so it does not claim to conserve energy.

FORMULA_CONST Real kDielectricReflectance = REAL(0.04);

struct MetallicRoughness {
    Vec3 baseColour;  // linear, [0, 1]
    Real metallic;    // [0, 1]
    Real roughness;   // perceptual, [0, 1]
};

FORMULA_FN Vec3 diffuseAlbedo(MetallicRoughness material) {
    return material.baseColour * (REAL(1.0) - material.metallic);
}

FORMULA_FN Vec3 reflectanceAtNormal(MetallicRoughness material) {
    return mix(Vec3(kDielectricReflectance), material.baseColour, material.metallic);
}

// Radiance towards the eye per irradiance on a surface that faces the light: BRDF times max(n.l, 0), in 1/sr. All
// directions are unit vectors in one frame, pointing away from the surface; a zero toLight (a light on the surface
// itself) gives 0.
FORMULA_FN Vec3 metallicRoughnessReflect(MetallicRoughness material, Vec3 normal, Vec3 toLight, Vec3 toEye) {
    Real cosLight = dot(normal, toLight);
    if (!(cosLight > REAL(0.0))) return Vec3(REAL(0.0));
    Vec3 f0 = reflectanceAtNormal(material);
    // Light and eye exactly opposite have no half vector. With zero for it the result is 0, which is also the limit:
    // the Fresnel term goes to 1 there and takes the diffuse part away, the distribution goes to 0.
    Vec3 halfway = normalizeOr(toLight + toEye, Vec3(REAL(0.0)));
    Vec3 fresnel = fresnelSchlick(f0, dot(toEye, halfway));
    Real alpha = alphaFromRoughness(material.roughness);
    Real distribution = ggxDistribution(dot(normal, halfway), lengthSquared(cross(normal, halfway)), alpha);
    Real specular = distribution * ggxVisibility(cosLight, dot(normal, toEye), alpha);
    Vec3 diffuse = (Vec3(REAL(1.0)) - fresnel) * lambertBrdf(diffuseAlbedo(material));
    return (diffuse + fresnel * specular) * cosLight;
}

// Radiance towards the eye under the same radiance from everywhere (W/(m^2 sr)); `occlusion` is the share of it that
// arrives (1: all; glTF dims ambient light only). The albedo is that at normal incidence, of the same mix as above: a
// white metal and a white dielectric reflect exactly all.
FORMULA_FN Vec3 metallicRoughnessAmbient(MetallicRoughness material, Vec3 ambientRadiance, Real occlusion) {
    Vec3 f0 = reflectanceAtNormal(material);
    return (f0 + (Vec3(REAL(1.0)) - f0) * diffuseAlbedo(material)) * ambientRadiance * occlusion;
}

// Occlusion from its texture's value and strength (glTF 2.0, 3.9.3).
FORMULA_FN Real occlusionFactor(Real texel, Real strength) { return REAL(1.0) + strength * (texel - REAL(1.0)); }
