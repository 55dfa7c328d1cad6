#ifndef __cplusplus
#include "formula/guard.glsl"
#endif

// How light fades with distance in the artist's way (textbook of the formulas 5.x), beside inverseSquare() in
// light.glsl, which is the physical one. Distances in metres, factors without unit, never above 1.

// kc + kl d + kq d^2 with k = (kc, kl, kq), all >= 0, and d in [0, 1e19]. At most 1e37, so that its reciprocal stays
// within the range in which GLSL divides precisely; d^2 alone reaches 1e38.
FORMULA_FN Real attenuationPolynomial(Real meters, Vec3 k) {
    return min(k.x + meters * (k.y + meters * k.z), REAL(1.0e37));
}

// min(1 / (kc + kl d + kq d^2), 1) (5.1). Where the sum is below 1, all coefficients 0 included, this is 1.
FORMULA_FN Real artistAttenuation(Real meters, Vec3 k) {
    Real sum = attenuationPolynomial(meters, k);
    if (!(sum > REAL(1.0))) return REAL(1.0);
    return REAL(1.0) / sum;
}

// max(p.l, 0)^sp: a spot's share in a direction, p from the light to the surface, l along its axis, both unit. With
// exponent 0 it is 1 everywhere, behind the spot as well (0^0 = 1), as OpenGL has it.
FORMULA_FN Real spotPower(Vec3 fromLight, Vec3 axis, Real exponent) {
    return cosinePower(dot(fromLight, axis), lengthSquared(cross(fromLight, axis)), exponent);
}

// The same, cut off at the cone: 1 for no spot (cosCone = -1, exponent 0), 0 outside the angle beta whose cosine is
// cosCone (the unnumbered case formula before 5.2). On the cone itself it is still lit. Cone angle 0 leaves the axis
// alone, pi cuts nothing.
FORMULA_FN Real spotCone(Vec3 fromLight, Vec3 axis, Real cosCone, Real exponent) {
    // Clamped, as rounding may push the cosine past the ends of the cone's range.
    if (!(clamp(dot(fromLight, axis), REAL(-1.0), REAL(1.0)) >= cosCone)) return REAL(0.0);
    return spotPower(fromLight, axis, exponent);
}

// min(max(p.l, 0)^sp / (kc + kl d + kq d^2), 1): (5.2), without a cone, attenuation included and the product clamped.
// Where the sum is below 1 it is brighter than spotPower() times artistAttenuation(). All coefficients 0: 1 wherever
// the spot's share is above 1e-30.
FORMULA_FN Real spotClampedProduct(Vec3 fromLight, Vec3 axis, Real exponent, Real meters, Vec3 k) {
    Real spot = spotPower(fromLight, axis, exponent);
    // Below this it is about to leave the range of float, and only a light without attenuation would still show it.
    if (!(spot > REAL(1.0e-30))) return REAL(0.0);
    Real sum = attenuationPolynomial(meters, k);
    if (!(sum > spot)) return REAL(1.0);
    return spot / sum;
}
