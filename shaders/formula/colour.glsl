#ifndef __cplusplus
#include "formula/guard.glsl"
#endif

// Colour is linear RGB with the primaries of sRGB everywhere inside; these are the ways in and out.

// The largest finite half float. Values beyond it become infinite in half-float files and images.
FORMULA_CONST Real kHalfMax = REAL(65504.0);

// IEC 61966-2-1, one channel of [0, 1].
FORMULA_FN Real linearFromSrgb(Real code) {
    Real x = saturate(code);
    if (x <= REAL(0.04045)) return x / REAL(12.92);
    return positivePower((x + REAL(0.055)) / REAL(1.055), REAL(2.4));
}

// The inverse; light outside [0, 1] is clamped.
FORMULA_FN Real srgbFromLinear(Real light) {
    Real x = saturate(light);
    if (x <= REAL(0.0031308)) return REAL(12.92) * x;
    return REAL(1.055) * positivePower(x, REAL(1.0) / REAL(2.4)) - REAL(0.055);
}

// Y of linear RGB (Rec. 709 weights, which are those of sRGB).
FORMULA_FN Real luminance(Vec3 colour) {
    return dot(colour, Vec3(REAL(0.2126), REAL(0.7152), REAL(0.0722)));
}

FORMULA_FN Real clampToHalf(Real x) { return clamp(x, -kHalfMax, kHalfMax); }
