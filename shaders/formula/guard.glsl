#ifndef __cplusplus
#include "formula/prelude.glsl"
#endif

// What keeps the other formulas finite and defined where GLSL and C++ leave a result open or disagree.

FORMULA_CONST Real kPi = REAL(3.14159265358979323846);
FORMULA_CONST Real kInversePi = REAL(0.31830988618379067154);

FORMULA_FN Real saturate(Real x) { return clamp(x, REAL(0.0), REAL(1.0)); }

FORMULA_FN Real lengthSquared(Vec3 v) { return dot(v, v); }

// The unit vector along v, or `fallback` where v has no direction. GLSL's normalize(0) is NaN and normalize(1e20) is 0:
// squares of components beyond 1e19 overflow and below 1e-19 vanish, hence the scaling by the largest component first.
// The ends are those between which GLSL promises a precise division, 2^-126 to 2^126.
FORMULA_FN Vec3 normalizeOr(Vec3 v, Vec3 fallback) {
    Real largest = max(max(abs(v.x), abs(v.y)), abs(v.z));
    if (!(largest >= REAL(1.2e-38)) || !(largest <= REAL(8.5e37))) return fallback;
    Vec3 scaled = v / largest;
    return scaled / sqrt(dot(scaled, scaled));
}

// |v|, for components of up to 1e19 and down to denormals, whose squares leave the range of float.
FORMULA_FN Real lengthOf(Vec3 v) {
    Real largest = max(max(abs(v.x), abs(v.y)), abs(v.z));
    if (!(largest >= REAL(1.2e-38))) return REAL(0.0);
    Vec3 scaled = v / largest;
    return largest * sqrt(dot(scaled, scaled));
}

// x^n for x in [0, 1] and n >= 0. Defined where GLSL is not: n = 0 gives 1, also for x = 0 (llvmpipe: pow(0, 0) = 0,
// C: 1); otherwise x <= 0 gives 0 (pow of a negative base is NaN).
FORMULA_FN Real positivePower(Real x, Real n) {
    if (!(n > REAL(0.0))) return REAL(1.0);
    if (!(x > REAL(0.0))) return REAL(0.0);
    return exp(n * log(min(x, REAL(1.0))));
}

// cos(a)^n for huge n, given the squared sine as well. Near 1 a float cosine has no digits left (pow(1 - 2^-24, 1e6) is
// 4 % wrong on llvmpipe), but the squared sine, taken from a cross product, has them all: log cos = log(1 - sin^2) / 2.
// The series is that of artanh, five terms: below sin^2 = 1/16 the first one left out is 1e-16 of the sum.
FORMULA_FN Real cosinePower(Real cosine, Real sineSquared, Real n) {
    if (!(n > REAL(0.0))) return REAL(1.0);
    if (!(cosine > REAL(0.0))) return REAL(0.0);
    if (sineSquared >= REAL(0.0625)) return positivePower(cosine, n);
    Real z = sineSquared / (REAL(2.0) - sineSquared);
    Real zz = z * z;
    Real series = REAL(1.0) + zz * (REAL(1.0) / REAL(3.0) + zz * (REAL(1.0) / REAL(5.0) +
                  zz * (REAL(1.0) / REAL(7.0) + zz * (REAL(1.0) / REAL(9.0)))));
    return exp(-n * z * series);
}
