#ifndef __cplusplus
#include "formula/guard.glsl"
#endif

// Generalised cosine lobes (Lafortune et al. 1997, "Non-linear approximation of reflectance functions"). A BRDF is a
// diffuse part (lambertBrdf) plus a few lobes; measured materials are fitted with two or three.

// albedo (C_x l_x v_x + C_y l_y v_y + C_z l_z v_z)^n, with directions in the frame of the surface (x, y along its
// tangents, z along its normal). C = (-1, -1, 1) mirrors (Phong), (1, 1, 1) returns light to where it came from,
// |C_z| < |C_x| shifts the peak off the mirror direction, (0, 0, 1) is a power of both cosines.
struct LafortuneLobe {
    Vec3 albedo;    // 1/sr: the lobe's value where the sum is 1
    Vec3 axes;      // C, components in [-2, 2]
    Real exponent;  // n in [0, 1e4]: beyond, the float rounding of the sum decides
};

// x^n for any x >= 0, where positivePower() stops at 1. At most e^80 = 5.5e34, so that it can still be multiplied.
FORMULA_FN Real unboundedPower(Real x, Real n) {
    if (!(n > REAL(0.0))) return REAL(1.0);
    if (!(x > REAL(0.0))) return REAL(0.0);
    return exp(min(n * log(x), REAL(80.0)));
}

// 1/sr. Reciprocal by construction. 0 unless light and eye are above the surface.
FORMULA_FN Vec3 lafortuneLobe(LafortuneLobe lobe, Vec3 toLightLocal, Vec3 toEyeLocal) {
    if (!(toLightLocal.z > REAL(0.0)) || !(toEyeLocal.z > REAL(0.0))) return Vec3(REAL(0.0));
    return lobe.albedo * unboundedPower(dot(lobe.axes * toLightLocal, toEyeLocal), lobe.exponent);
}

// A direction's components in the frame of the surface; the three axes are unit and orthogonal, in the direction's
// frame.
FORMULA_FN Vec3 localFromFrame(Vec3 direction, Vec3 tangent, Vec3 bitangent, Vec3 normal) {
    return Vec3(dot(direction, tangent), dot(direction, bitangent), dot(direction, normal));
}

// The albedo of a mirroring lobe (C = (-1, -1, 1)) that returns the share k_s seen straight on and never more:
// k_s (n + 2) / (2 pi).
FORMULA_FN Vec3 lafortuneMirrorAlbedo(Vec3 specular, Real exponent) {
    return specular * ((exponent + REAL(2.0)) * (REAL(0.5) * kInversePi));
}
