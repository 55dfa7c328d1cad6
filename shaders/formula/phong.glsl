#ifndef __cplusplus
#include "formula/guard.glsl"
#endif

// Highlights: shares of 1, without unit, that a model multiplies with a specular colour. All directions are unit vectors
// that point away from the surface, in one frame; shininess s >= 0. blinn_phong.glsl has the half vector's.

// r = 2 (n.d) n - d: the mirror image of a direction in the surface.
FORMULA_FN Vec3 mirrorDirection(Vec3 normal, Vec3 direction) {
    return normal * (REAL(2.0) * dot(normal, direction)) - direction;
}

// max(r.v, 0)^s with r mirrored from the light (5.9; Phong 1975). Ungated: also a light behind the surface makes a
// highlight.
FORMULA_FN Real phongHighlight(Vec3 normal, Vec3 toLight, Vec3 toEye, Real shininess) {
    Vec3 mirrored = mirrorDirection(normal, toLight);
    return cosinePower(dot(mirrored, toEye), lengthSquared(cross(mirrored, toEye)), shininess);
}

// The same, and 0 unless n.l > 0 (5.10).
FORMULA_FN Real phongHighlightGated(Vec3 normal, Vec3 toLight, Vec3 toEye, Real shininess) {
    if (!(dot(normal, toLight) > REAL(0.0))) return REAL(0.0);
    return phongHighlight(normal, toLight, toEye, shininess);
}

// t / (s - s t + t): Schlick's substitute for t^s (Schlick 1994, "A fast alternative to Phong's specular model"), for
// t = cosine in [0, 1]; same value at 0 and 1 and same slope at 1, a longer tail. Written with
// 1 - t = sin^2 / (1 + t), which keeps its digits near the peak. As for the power it stands for, s = 0 gives 1 and
// otherwise t <= 0 gives 0.
FORMULA_FN Real schlickPower(Real cosine, Real sineSquared, Real exponent) {
    if (!(exponent > REAL(0.0))) return REAL(1.0);
    if (!(cosine > REAL(0.0))) return REAL(0.0);
    Real t = min(cosine, REAL(1.0));
    return t / (t + exponent * sineSquared / (REAL(1.0) + t));
}

// Schlick's substitute of the half angle, gated by n.l > 0 as (5.11) is; 0 where light and eye are exactly opposite.
FORMULA_FN Real schlickHighlight(Vec3 normal, Vec3 toLight, Vec3 toEye, Real shininess) {
    if (!(dot(normal, toLight) > REAL(0.0))) return REAL(0.0);
    Vec3 halfway = normalizeOr(toLight + toEye, Vec3(REAL(0.0)));
    if (!(lengthSquared(halfway) > REAL(0.0))) return REAL(0.0);
    return schlickPower(dot(normal, halfway), lengthSquared(cross(normal, halfway)), shininess);
}

// Radiance towards the eye per irradiance on a surface that faces the light, 1/sr: k_s (s + 2) / (2 pi) (r.v)^s (n.l)
// (Lafortune & Willems 1994, "Using the modified Phong reflectance model for physically based rendering"). Divided by
// n.l it is reciprocal. It conserves energy: seen straight on exactly k_s comes back, under any other angle less. 0 when
// light or eye is behind the surface.
FORMULA_FN Vec3 normalisedPhongReflect(Vec3 specular, Real shininess, Vec3 normal, Vec3 toLight, Vec3 toEye) {
    Real cosLight = dot(normal, toLight);
    if (!(cosLight > REAL(0.0)) || !(dot(normal, toEye) > REAL(0.0))) return Vec3(REAL(0.0));
    Real peak = (shininess + REAL(2.0)) * (REAL(0.5) * kInversePi);
    return specular * (peak * phongHighlight(normal, toLight, toEye, shininess) * cosLight);
}

// Phong's model as a BRDF, 1/sr (Ganster 1.1.5, corrected: the exponent m is missing in print):
// k_s cos^m(r, w_o) / cos(w_i, n), 0 unless n.l > 0. NOT reciprocal, does not conserve energy, and is unbounded as the
// light grazes: k_s in 1/sr can be no reflectance. The cosine is held above 1e-4, 0.006 degrees.
FORMULA_FN Vec3 nonReciprocalPhongBrdf(Vec3 specular, Real shininess, Vec3 normal, Vec3 toLight, Vec3 toEye) {
    Real highlight = phongHighlightGated(normal, toLight, toEye, shininess);
    return specular * (highlight / max(dot(normal, toLight), REAL(1.0e-4)));
}

// That BRDF times n.l, which removes the division: k_s cos^m, 1/sr.
FORMULA_FN Vec3 nonReciprocalPhongReflect(Vec3 specular, Real shininess, Vec3 normal, Vec3 toLight, Vec3 toEye) {
    return specular * phongHighlightGated(normal, toLight, toEye, shininess);
}
