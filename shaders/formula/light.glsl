#ifndef __cplusplus
#include "formula/guard.glsl"
#endif

// From what a light radiates to what arrives: intensity (W/sr) to irradiance (W/m^2) on a surface that faces the light.

// Nearer than this a point light is no longer a point; 1/d^2 stops growing. Square metres: a bulb of 1 cm.
FORMULA_CONST Real kMinDistanceSquared = REAL(1.0e-4);

// 1/d^2 (Ganster 1.1.2), in 1/m^2.
FORMULA_FN Real inverseSquare(Real distanceSquared) { return REAL(1.0) / max(distanceSquared, kMinDistanceSquared); }

// KHR_lights_punctual: max(min(1 - (d / range)^4, 1), 0). A range of 0 or less is unlimited.
FORMULA_FN Real rangeWindow(Real distanceSquared, Real range) {
    if (!(range > REAL(0.0))) return REAL(1.0);
    // Divided one by one: the square of a range beyond 1e19 is infinite, and that of one below 1e-19 is 0.
    Real ratio = sqrt(distanceSquared) / range;
    Real squared = min(ratio * ratio, REAL(2.0));
    return saturate(REAL(1.0) - squared * squared);
}

// A spot's edge is given by the cosine of the outer angle and this scale (KHR_lights_punctual). Its 0.001 keeps inner =
// outer defined: the edge is then 0.001 wide in the cosine, inside the outer angle.
FORMULA_FN Real spotScale(Real cosInner, Real cosOuter) { return REAL(1.0) / max(REAL(0.001), cosInner - cosOuter); }

// 1 inside the inner cone, 0 outside the outer one, smooth between. `cosAngle` is between the spot's axis and the
// direction from the light to the surface. glTF writes saturate(cosAngle * scale + offset)^2; taking the difference
// first loses no digits.
FORMULA_FN Real spotFactor(Real cosAngle, Real cosOuter, Real scale) {
    Real t = saturate((cosAngle - cosOuter) * scale);
    return t * t;
}

// The unit vector towards a point light and the squared distance. Exactly on the light there is no direction: zero,
// which lights nothing.
FORMULA_FN Vec3 directionTo(Vec3 light, Vec3 surface, OUT(Real) distanceSquared) {
    Vec3 difference = light - surface;
    distanceSquared = lengthSquared(difference);
    return normalizeOr(difference, Vec3(REAL(0.0)));
}
