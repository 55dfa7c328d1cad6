#ifndef __cplusplus
#include "formula/guard.glsl"
#endif

// Angles, for what is tabulated over them. Everything else works on cosines and sines.

// atan(x) for x in [0, 1]. The argument is halved twice (tan(a/2) = x / (1 + sqrt(1 + x^2))), then ten terms of the
// series are enough: at tan(pi/16) = 0.199 the first one left out is 2e-16. Own code, as drivers' functions differ:
// llvmpipe's atan is off by 3.4e-6 rad, its acos by 1.6e-4.
FORMULA_FN Real arcTangentOfUnit(Real x) {
    Real y = x / (REAL(1.0) + sqrt(REAL(1.0) + x * x));
    y = y / (REAL(1.0) + sqrt(REAL(1.0) + y * y));
    Real t = y * y;
    Real series = REAL(1.0) - t * (REAL(1.0) / REAL(3.0) - t * (REAL(1.0) / REAL(5.0) - t * (REAL(1.0) / REAL(7.0) -
                  t * (REAL(1.0) / REAL(9.0) - t * (REAL(1.0) / REAL(11.0) - t * (REAL(1.0) / REAL(13.0) -
                  t * (REAL(1.0) / REAL(15.0) - t * (REAL(1.0) / REAL(17.0) - t * (REAL(1.0) / REAL(19.0))))))))));
    return REAL(4.0) * y * series;
}

// The angle of (x, y) from the x axis, in [-pi, pi] radians; 0 where both are 0. Only their ratio matters.
FORMULA_FN Real angleOf(Real y, Real x) {
    Real across = abs(x);
    Real along = abs(y);
    Real larger = max(across, along);
    if (!(larger > REAL(0.0))) return REAL(0.0);
    Real angle = arcTangentOfUnit(min(across, along) / larger);
    if (along > across) angle = REAL(0.5) * kPi - angle;
    if (x < REAL(0.0)) angle = kPi - angle;
    return y < REAL(0.0) ? -angle : angle;
}

// The angle between two unit vectors, in [0, pi], exact also where they nearly agree or oppose.
FORMULA_FN Real angleBetween(Vec3 a, Vec3 b) { return angleOf(lengthOf(cross(a, b)), dot(a, b)); }
