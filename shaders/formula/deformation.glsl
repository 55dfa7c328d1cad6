#ifndef __cplusplus
#include "formula/guard.glsl"
#endif

// Skinning by a weighted sum of affine maps (Magnenat-Thalmann et al. 1988; glTF 2.0, 3.7.3.3), and what it makes of
// normals. Domain: components up to 1e12, weights in [0, 1] that sum to 1.

// A point p goes to x p.x + y p.y + z p.z + origin.
struct AffineMap {
    Vec3 x;
    Vec3 y;
    Vec3 z;
    Vec3 origin;
};

FORMULA_FN AffineMap weightedMap(AffineMap map, Real weight) {
    AffineMap result;
    result.x = map.x * weight;
    result.y = map.y * weight;
    result.z = map.z * weight;
    result.origin = map.origin * weight;
    return result;
}

FORMULA_FN AffineMap sumOfMaps(AffineMap a, AffineMap b) {
    AffineMap result;
    result.x = a.x + b.x;
    result.y = a.y + b.y;
    result.z = a.z + b.z;
    result.origin = a.origin + b.origin;
    return result;
}

FORMULA_FN Vec3 mappedDirection(AffineMap map, Vec3 v) { return map.x * v.x + map.y * v.y + map.z * v.z; }

FORMULA_FN Vec3 mappedPoint(AffineMap map, Vec3 p) { return mappedDirection(map, p) + map.origin; }

// The unit normal of a mapped surface: the cofactors instead of the inverse's transpose, equal up to a scale and defined
// for maps that flatten, too; turned so that what was outside stays outside under a map that mirrors. The columns are
// scaled by their largest component first, since products of three of them leave the range of float. `n` itself where
// the map leaves no surface.
FORMULA_FN Vec3 mappedSurfaceNormal(AffineMap map, Vec3 n) {
    Vec3 columns = max(max(abs(map.x), abs(map.y)), abs(map.z));
    Real largest = max(max(columns.x, columns.y), columns.z);
    if (!(largest >= REAL(1.2e-38)) || !(largest <= REAL(8.5e37))) return n;
    Vec3 x = map.x / largest;
    Vec3 y = map.y / largest;
    Vec3 z = map.z / largest;
    Vec3 yz = cross(y, z);
    Vec3 normal = yz * n.x + cross(z, x) * n.y + cross(x, y) * n.z;
    if (dot(x, yz) < REAL(0.0)) normal = -normal;
    return normalizeOr(normal, n);
}

// The unit normal of a triangle, counter-clockwise seen from its tip; (0, 0, 1) for one without area. The edges are
// made unit vectors first, so that neither tiny nor huge triangles lose theirs.
FORMULA_FN Vec3 triangleNormal(Vec3 a, Vec3 b, Vec3 c) {
    Vec3 ab = normalizeOr(b - a, Vec3(REAL(0.0)));
    Vec3 ac = normalizeOr(c - a, Vec3(REAL(0.0)));
    return normalizeOr(cross(ab, ac), Vec3(REAL(0.0), REAL(0.0), REAL(1.0)));
}
