#ifndef __cplusplus
#include "formula/guard.glsl"
#endif

// Bias and comparison of every shadow map.

// How high above its own plane a receiver must be moved so that it does not shadow itself, in metres.
//
// A map stores the depth of texel centres. A plane with unit normal n in the light's frame (x and y along the texels, z
// along its axis) is stored up to `reachTexels` away in x and in y: there its depth differs by
// (|n.x| + |n.y|) / |n.z| * reach * texel. A height d above the plane is d / |n.z| of depth, so
// d = reach * texel * (|n.x| + |n.y|) is enough at every angle, grazing included, and no more than needed. The same
// holds, to first order in the texel, for a perspective map with the texel size at the receiver. Reach is 1/2 for one
// nearest texel, 1 for the 2x2 comparison of the hardware, and a filter's radius more for wider ones.
FORMULA_FN Real shadowNormalOffset(Vec3 normalLight, Real texel, Real reachTexels) {
    return reachTexels * texel * (abs(normalLight.x) + abs(normalLight.y));
}

// How far towards the light a receiver must be moved to come this height, in metres, above its own plane; cosine: between
// the plane's normal and the way to the light. The way along the normal to the same height leads to another place of the
// map, up to the height times the sine away, and with it moves every shadow's edge. Where the light grazes there is
// nothing left to darken, and the way is held.
FORMULA_FN Real shadowOffsetToLight(Real height, Real cosine) { return height / max(cosine, REAL(1e-3)); }

// How far in depth, in metres, a receiver must be moved towards the light for the rounding of float coordinates up to
// `largestCoordinate` (metres, in the frame that is transformed): a transform of four products and three sums on each
// side, and the interpolation in between, 8 units in the last place of 2^-23 together.
FORMULA_FN Real shadowRoundingBias(Real largestCoordinate) { return largestCoordinate * REAL(9.5367431640625e-7); }

// 1 where lit. Equal depths are lit. Depth grows away from the light.
FORMULA_FN Real shadowCompare(Real storedDepth, Real receiverDepth) {
    return receiverDepth <= storedDepth ? REAL(1.0) : REAL(0.0);
}

// The hardware's 2x2 filter: four comparisons, mixed by the position between the four texel centres, x and y in
// [0, 1]. (GL 4.5, 8.14.1 and 8.23.1: the results are filtered, not the depths.)
FORMULA_FN Real shadowMix2x2(Real lit00, Real lit10, Real lit01, Real lit11, Real x, Real y) {
    return mix(mix(lit00, lit10, x), mix(lit01, lit11, x), y);
}

// How dark a blob is, by the distance from its middle over its radius: dark in its inner half, fading smoothly outside.
FORMULA_FN Real blobDarkness(Real distanceOverRadius) {
    Real t = clamp(REAL(2.0) * distanceOverRadius - REAL(1.0), REAL(0.0), REAL(1.0));
    return REAL(1.0) - t * t * (REAL(3.0) - REAL(2.0) * t);
}
