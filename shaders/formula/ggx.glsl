#ifndef __cplusplus
#include "formula/guard.glsl"
#endif

// Trowbridge-Reitz (GGX) microfacets: Walter et al. 2007; visibility: Heitz 2014, height-correlated.

// Smallest perceptual roughness, alpha 0.002. A float half vector is off by about 1e-7; the peak's width is alpha, so
// below this the distribution would change by more than 1e-4 with rounding alone, and at 0 it is 0/0. The peak
// 1 / (pi alpha^2) is then 7.8e4. The value is also Filament's.
FORMULA_CONST Real kMinRoughness = REAL(0.045);

// Cosines below this count as this in the visibility term, where 0/0 lurks; interpolated normals do turn away from the
// eye. 1e-4 is 0.006 degrees from grazing.
FORMULA_CONST Real kMinCosine = REAL(1.0e-4);

// alpha of the formulas from the roughness that artists set, in [0, 1] (glTF 2.0, appendix B.2.3).
FORMULA_FN Real alphaFromRoughness(Real roughness) {
    Real r = clamp(roughness, kMinRoughness, REAL(1.0));
    return r * r;
}

// Density of microfacet normals, 1/sr: alpha^2 / (pi ((n.h)^2 (alpha^2 - 1) + 1)^2), and 0 behind the surface. Written
// with sin^2 = |n x h|^2, as 1 - (n.h)^2 has no digits left near the peak.
FORMULA_FN Real ggxDistribution(Real cosNormalHalf, Real sineSquaredNormalHalf, Real alpha) {
    if (!(cosNormalHalf > REAL(0.0))) return REAL(0.0);
    Real alphaCos = alpha * cosNormalHalf;
    Real k = alpha / (alphaCos * alphaCos + sineSquaredNormalHalf);
    return k * k * kInversePi;
}

// G / (4 (n.l) (n.v)), 1/sr^0; symmetric in light and eye. 0 where either is behind the surface.
FORMULA_FN Real ggxVisibility(Real cosLight, Real cosEye, Real alpha) {
    Real l = max(cosLight, kMinCosine);
    Real v = max(cosEye, kMinCosine);
    Real aa = alpha * alpha;
    Real fromEye = l * sqrt(v * v * (REAL(1.0) - aa) + aa);
    Real fromLight = v * sqrt(l * l * (REAL(1.0) - aa) + aa);
    return REAL(0.5) / (fromEye + fromLight);
}
