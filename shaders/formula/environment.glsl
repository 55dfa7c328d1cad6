#ifndef __cplusplus
#include "formula/angle.glsl"
#endif

// Light from all around, kept in an image (Ganster 1.2.2). Directions are unit vectors in the environment's frame.

// Where a panorama shows a direction: x in [0, 1] grows with the azimuth from -Z over +X, so that -Z, straight ahead, is
// in the middle and +X right of it; y in [0, 1] grows downwards from +Y.
FORMULA_FN Vec2 latLongFromDirection(Vec3 direction) {
    Real azimuth = angleOf(direction.x, -direction.z);
    Real fromTop = angleOf(sqrt(direction.x * direction.x + direction.z * direction.z), direction.y);
    return Vec2(REAL(0.5) + azimuth * (REAL(0.5) * kInversePi), fromTop * kInversePi);
}

FORMULA_FN Vec3 directionFromLatLong(Vec2 place) {
    Real azimuth = (place.x - REAL(0.5)) * (REAL(2.0) * kPi);
    Real fromTop = place.y * kPi;
    Real around = sin(fromTop);
    return Vec3(around * sin(azimuth), cos(fromTop), -around * cos(azimuth));
}

// Steradians of one texel of a panorama of columns x rows, in row j from the top: 2 pi / columns times the difference of
// cosines, written as a product that keeps its digits at the poles.
FORMULA_FN Real latLongTexelSolidAngle(int row, int columns, int rows) {
    Real step = kPi / Real(rows);
    int fromPole = min(row, rows - 1 - row);
    return REAL(4.0) * kPi / Real(columns) * sin((Real(fromPole) + REAL(0.5)) * step) * sin(REAL(0.5) * step);
}

// The face of a cube map, in OpenGL's order: 0 +X, 1 -X, 2 +Y, 3 -Y, 4 +Z, 5 -Z (OpenGL 4.5, table 8.19). On an edge the
// first of x, y, z wins.
FORMULA_FN int cubeFace(Vec3 direction) {
    Real x = abs(direction.x);
    Real y = abs(direction.y);
    Real z = abs(direction.z);
    if (x >= y && x >= z) return direction.x >= REAL(0.0) ? 0 : 1;
    if (y >= z) return direction.y >= REAL(0.0) ? 2 : 3;
    return direction.z >= REAL(0.0) ? 4 : 5;
}

// Where that face shows the direction, in [0, 1]^2, from the first texel of the image; the middle for no direction.
FORMULA_FN Vec2 cubePlace(Vec3 direction) {
    int face = cubeFace(direction);
    Real s = direction.x;
    Real t = -direction.y;
    Real axis = abs(direction.z);
    if (face == 0) s = -direction.z;
    if (face == 1) s = direction.z;
    if (face == 2) t = direction.z;
    if (face == 3) t = -direction.z;
    if (face == 5) s = -direction.x;
    if (face < 2) axis = abs(direction.x);
    if (face == 2 || face == 3) axis = abs(direction.y);
    if (!(axis > REAL(0.0))) return Vec2(REAL(0.5));
    return Vec2(REAL(0.5) + REAL(0.5) * (s / axis), REAL(0.5) + REAL(0.5) * (t / axis));
}

// The inverse, not normalised: the point of the cube of half side 1.
FORMULA_FN Vec3 directionFromCube(int face, Vec2 place) {
    Real s = place.x * REAL(2.0) - REAL(1.0);
    Real t = place.y * REAL(2.0) - REAL(1.0);
    if (face == 0) return Vec3(REAL(1.0), -t, -s);
    if (face == 1) return Vec3(REAL(-1.0), -t, s);
    if (face == 2) return Vec3(s, REAL(1.0), t);
    if (face == 3) return Vec3(s, REAL(-1.0), -t);
    if (face == 4) return Vec3(s, -t, REAL(1.0));
    return Vec3(-s, -t, REAL(-1.0));
}

// Steradians per texel at a place of a cube face of `size` x `size` texels, to first order:
// (2 / size)^2 / (1 + s^2 + t^2)^(3/2).
FORMULA_FN Real cubeTexelSolidAngle(Vec2 place, Real size) {
    Real s = place.x * REAL(2.0) - REAL(1.0);
    Real t = place.y * REAL(2.0) - REAL(1.0);
    Real squared = REAL(1.0) + s * s + t * t;
    return REAL(4.0) / (size * size * squared * sqrt(squared));
}

// The weight of one texel in the image that is convolved for diffuse reflection: max(n.w, 0) dw / pi. Over all texels
// they sum to 1, so an even environment of radiance L is convolved to L.
FORMULA_FN Real diffuseConvolutionWeight(Vec3 normal, Vec3 direction, Real solidAngle) {
    return max(dot(normal, direction), REAL(0.0)) * solidAngle * kInversePi;
}

// k_s times the radiance in the mirror direction plus k_d times the convolved radiance for the normal. At most 1 comes
// back of an even environment when k_s + k_d <= 1.
FORMULA_FN Vec3 environmentReflect(Vec3 specular, Vec3 diffuse, Vec3 mirrored, Vec3 convolved) {
    return specular * mirrored + diffuse * convolved;
}

// What microfacets of reflectance f0 at normal incidence mirror of an even environment: f0 x + y, where x and y are the
// integrals over the lobe without and with Schlick's rise (the split sum; Karis 2013).
FORMULA_FN Vec3 environmentMirrored(Vec3 f0, Real x, Real y) { return f0 * x + Vec3(y); }

// What they leave to the diffuse part: 1 - F averaged over the light's directions by cosine, where `rise` is the average
// of Schlick's (1 - cos)^5.
FORMULA_FN Vec3 environmentUnmirrored(Vec3 f0, Real rise) {
    return (Vec3(REAL(1.0)) - f0) * (REAL(1.0) - rise);
}

// The perceptual roughness of the GGX lobe that is as wide as cos^n: alpha^2 = 2 / (n + 2) (Walter et al. 2007).
FORMULA_FN Real roughnessFromExponent(Real n) {
    return sqrt(sqrt(REAL(2.0) / (max(n, REAL(0.0)) + REAL(2.0))));
}
