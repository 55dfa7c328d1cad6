#ifndef __cplusplus
#include "formula/metallic_roughness.glsl"
#endif

// Microfacets (Torrance & Sparrow 1967) with GGX, over a diffuse base, coupled so that energy is conserved. The same
// material as metallic_roughness.glsl, which draws what glTF says: there the diffuse part is dimmed by 1 - F(v.h), the
// Fresnel term of that one half vector (glTF 2.0, B.3.5), and so a smooth white dielectric at grazing reflects its coat
// and nearly the whole of its base (1.72 of what it gets at 87 degrees).

struct TorranceSparrow {
    Vec3 diffuse;      // reflectance of the base, [0, 1]
    Vec3 reflectance;  // of the facets at normal incidence, [0, 1]
    Real roughness;    // perceptual, [0, 1]
};

FORMULA_FN TorranceSparrow torranceSparrowFrom(MetallicRoughness material) {
    TorranceSparrow t;
    t.diffuse = diffuseAlbedo(material);
    t.reflectance = reflectanceAtNormal(material);
    t.roughness = material.roughness;
    return t;
}

// 1 - (1 - cos / 2)^5: how much of a direction reaches the base.
FORMULA_FN Real baseShare(Real cosine) {
    Real x = REAL(1.0) - REAL(0.5) * saturate(cosine);
    Real xx = x * x;
    return REAL(1.0) - xx * xx * x;
}

// 28 / (23 pi) d (1 - f0) (1 - (1 - n.l / 2)^5) (1 - (1 - n.v / 2)^5) in 1/sr, the base below a coat of Schlick's Fresnel
// (Ashikhmin & Shirley 2000, "An anisotropic Phong BRDF model", eq. 5; 28/23 makes the integral over one direction
// d (1 - f0)). Reciprocal; no more comes back than the coat leaves.
FORMULA_FN Vec3 coupledDiffuseBrdf(Vec3 diffuse, Vec3 reflectance, Real cosLight, Real cosEye) {
    return diffuse * (Vec3(REAL(1.0)) - reflectance) *
           (REAL(28.0) / REAL(23.0) * kInversePi * baseShare(cosLight) * baseShare(cosEye));
}

// Radiance towards the eye per irradiance on a surface that faces the light, 1/sr: BRDF times n.l. 0 when the light or
// the eye is behind the surface, so that the BRDF is reciprocal.
FORMULA_FN Vec3 torranceSparrowReflect(TorranceSparrow material, Vec3 normal, Vec3 toLight, Vec3 toEye) {
    Real cosLight = dot(normal, toLight);
    Real cosEye = dot(normal, toEye);
    if (!(cosLight > REAL(0.0)) || !(cosEye > REAL(0.0))) return Vec3(REAL(0.0));
    Vec3 halfway = normalizeOr(toLight + toEye, Vec3(REAL(0.0)));
    Real alpha = alphaFromRoughness(material.roughness);
    Vec3 fresnel = fresnelSchlick(material.reflectance, dot(toEye, halfway));
    Real distribution = ggxDistribution(dot(normal, halfway), lengthSquared(cross(normal, halfway)), alpha);
    Vec3 facets = fresnel * (distribution * ggxVisibility(cosLight, cosEye, alpha));
    return (facets + coupledDiffuseBrdf(material.diffuse, material.reflectance, cosLight, cosEye)) * cosLight;
}
