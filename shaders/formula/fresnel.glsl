#ifndef __cplusplus
#include "formula/guard.glsl"
#endif

// Reflectance at normal incidence between two media, `ior` being the ratio of their refractive indices. 1.5 gives 0.04.
FORMULA_FN Real reflectanceFromIor(Real ior) {
    Real r = (ior - REAL(1.0)) / (ior + REAL(1.0));
    return r * r;
}

// (1 - cos)^5, Schlick 1994, eq. 15. The cosine is clamped: by rounding it may exceed 1. Products, since pow is not
// exact.
FORMULA_FN Real schlickWeight(Real cosine) {
    Real x = saturate(REAL(1.0) - cosine);
    Real xx = x * x;
    return xx * xx * x;
}

// Reflectance under an angle, from f0 straight on to 1 at grazing (Schlick 1994).
FORMULA_FN Vec3 fresnelSchlick(Vec3 f0, Real cosine) { return f0 + (Vec3(REAL(1.0)) - f0) * schlickWeight(cosine); }
