#ifndef __cplusplus
#include "formula/guard.glsl"
#endif

// BRDF of an ideal diffuse surface, 1/sr: the share `albedo` of the irradiance leaves evenly in all directions.
FORMULA_FN Vec3 lambertBrdf(Vec3 albedo) { return albedo * kInversePi; }
