#ifndef __cplusplus
#include "formula/guard.glsl"
#endif

// The tangent-space normal in a texel of [0, 1], scaled in x and y (glTF 2.0, 3.9.3). Not normalised.
FORMULA_FN Vec3 normalFromTexel(Vec3 texel, Real scale) {
    Vec3 n = texel * REAL(2.0) - Vec3(REAL(1.0));
    return Vec3(n.x * scale, n.y * scale, n.z);
}

// The unit normal of a normal-mapped surface. `normal` and `tangent` are interpolated, in one frame, of any length;
// the bitangent is cross(normal, tangent) * handedness (glTF 2.0, 3.7.2.1). Where the tangent vanishes or lies along
// the normal, there is no frame and the normal is returned; where the normal vanishes, `fallback` is.
FORMULA_FN Vec3 mappedNormal(Vec3 normal, Vec3 tangent, Real handedness, Vec3 mapped, Vec3 fallback) {
    Vec3 n = normalizeOr(normal, fallback);
    Vec3 along = normalizeOr(tangent, Vec3(REAL(0.0)));
    Vec3 across = along - n * dot(n, along);
    // Below this sine the direction left over is rounding.
    if (!(lengthSquared(across) > REAL(1.0e-10))) return n;
    Vec3 t = normalizeOr(across, Vec3(REAL(0.0)));
    Vec3 b = cross(n, t) * handedness;
    return normalizeOr(t * mapped.x + b * mapped.y + n * mapped.z, n);
}

// v in a right-handed frame whose z is `axis`, unit: how the others lie jumps where axis.z passes 0, and nowhere is there a
// direction without a frame. (Duff et al., Building an orthonormal basis, revisited, JCGT 6/1, 2017.)
FORMULA_FN Vec3 inFrameAlong(Vec3 axis, Vec3 v) {
    Real side = axis.z < REAL(0.0) ? REAL(-1.0) : REAL(1.0);
    Real a = REAL(-1.0) / (side + axis.z);
    Real b = axis.x * axis.y * a;
    Vec3 x = Vec3(REAL(1.0) + side * axis.x * axis.x * a, side * b, -side * axis.x);
    Vec3 y = Vec3(b, side + axis.y * axis.y * a, -axis.y);
    return Vec3(dot(x, v), dot(y, v), dot(axis, v));
}
