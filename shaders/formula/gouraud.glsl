#ifndef __cplusplus
#include "formula/light.glsl"
#include "formula/phong.glsl"
#endif

// Gouraud's model with the geometry term (Ganster 1.1.5, equations 4 to 8), in radiance: L = L_amb + sum of L_diff +
// L_spec. The model of the sum, whether it is evaluated at vertices or in pixels.

// (4): r_amb c_amb B_amb in W/(m^2 sr), c_amb being 1/sr and B_amb the ambient irradiance in W/m^2.
FORMULA_FN Vec3 gouraudAmbient(Vec3 ambient, Vec3 ambientIrradiance) { return ambient * ambientIrradiance; }

// (7): g = sr / r^2 for a point light, sr / m^2 for a directional one, 0 in shadow; `lit` is the share that is not in
// shadow. Below 1 cm r counts as 1 cm, as in inverseSquare().
FORMULA_FN Real geometryTermPoint(Real distanceSquared, Real lit) { return lit * inverseSquare(distanceSquared); }
FORMULA_FN Real geometryTermDirectional(Real lit) { return lit; }

// (5): r_diff g I cos(theta), 0 beyond 90 degrees. I in W/sr.
FORMULA_FN Vec3 gouraudDiffuse(Vec3 diffuse, Real geometry, Vec3 intensity, Vec3 normal, Vec3 toLight) {
    return diffuse * intensity * (geometry * max(dot(normal, toLight), REAL(0.0)));
}

// (6): r_spec g I cos^m(gamma), 0 beyond 90 degrees, gamma between the mirrored light and the eye. As printed, n.l does
// not gate it.
FORMULA_FN Vec3 gouraudSpecular(Vec3 specular, Real exponent, Real geometry, Vec3 intensity, Vec3 normal, Vec3 toLight,
                                Vec3 toEye) {
    return specular * intensity * (geometry * phongHighlight(normal, toLight, toEye, exponent));
}
