#ifndef __cplusplus
#include "formula/guard.glsl"
#endif

// Fog: the share f of a surface's own colour that is left after `meters` of Euclidean distance from the eye, in [0, 1].
// Not of the depth z: the walls of a CAVE look different ways and must agree. Density in 1/m, >= 0; 0 is no fog.

// (end - d) / (end - start), between 1 at `start` and 0 at `end`. start = end is a step: 1 before, 0 from there on.
FORMULA_FN Real fogLinear(Real meters, Real start, Real end) {
    if (!(end > start)) return meters < start ? REAL(1.0) : REAL(0.0);
    return saturate((end - meters) / (end - start));
}

// Its square: the fog comes quickly at first and thickens slowly, as with exp, but is complete at `end`.
FORMULA_FN Real fogQuadratic(Real meters, Real start, Real end) {
    Real left = fogLinear(meters, start, end);
    return left * left;
}

// exp(-density d).
FORMULA_FN Real fogExponential(Real meters, Real density) {
    // exp(-200) is 0 in float, and as good as that in double.
    return exp(-min(meters * density, REAL(200.0)));
}

// exp(-(density d)^2).
FORMULA_FN Real fogSquaredExponential(Real meters, Real density) {
    Real x = min(meters * density, REAL(15.0));
    return exp(-x * x);
}

// c' = f c + (1 - f) n, n being the fog's own colour.
FORMULA_FN Vec3 fogMixed(Vec3 colour, Vec3 fog, Real share) { return colour * share + fog * (REAL(1.0) - share); }
