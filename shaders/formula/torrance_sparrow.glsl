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

// An upper bound of what a GGX coat of f0 = 0 gives back of an even light, seen under a cosine: the integral of
// D V (1 - v.h)^5 n.l, ours, fitted as k ((1 - t) x^5 + t x^3.5) with x = 1 - cosine. It is nowhere more than 1e-3 below
// the integral, and above it by 0.18 at most (near grazing); tests/numerics holds it to that. A coat of any f0 gives back at most
// f0 + (1 - f0) times this.
FORMULA_FN Real coatShare(Real cosine, Real roughness) {
    Real r = clamp(roughness, kMinRoughness, REAL(1.0));
    Real alpha = r * r;
    Real x = saturate(REAL(1.0) - cosine);
    Real cubed = x * x * x;
    Real shape = mix(cubed * x * x, cubed * sqrt(x), min(r / REAL(0.3), REAL(1.0)));
    return shape / (REAL(1.0) + alpha * (REAL(6.5) + REAL(12.0) * alpha));
}

// Its mean over the hemisphere, weighted with 2 cosine: that of x^n is 2 / ((n + 1) (n + 2)).
FORMULA_FN Real coatShareMean(Real roughness) {
    Real r = clamp(roughness, kMinRoughness, REAL(1.0));
    Real alpha = r * r;
    Real shape = mix(REAL(1.0) / REAL(21.0), REAL(8.0) / REAL(99.0), min(r / REAL(0.3), REAL(1.0)));
    return shape / (REAL(1.0) + alpha * (REAL(6.5) + REAL(12.0) * alpha));
}

// d (1 - f0) (1 - C(n.l)) (1 - C(n.v)) / (pi (1 - mean C)) in 1/sr, the base below a coat whose share is C (albedo
// scaling: Kelemen & Szirmay-Kalos 2001, "A microfacet based coupled specular-matte BRDF model"). Reciprocal. Over all
// lights it comes to d (1 - f0) (1 - C(n.v)): what the coat has left, times d.
FORMULA_FN Vec3 coupledDiffuseBrdf(Vec3 diffuse, Vec3 reflectance, Real roughness, Real cosLight, Real cosEye) {
    Real left = (REAL(1.0) - coatShare(cosLight, roughness)) * (REAL(1.0) - coatShare(cosEye, roughness)) /
                (REAL(1.0) - coatShareMean(roughness));
    return diffuse * (Vec3(REAL(1.0)) - reflectance) * (left * kInversePi);
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
    Vec3 base = coupledDiffuseBrdf(material.diffuse, material.reflectance, material.roughness, cosLight, cosEye);
    return (facets + base) * cosLight;
}
