#ifndef __cplusplus
#include "formula/guard.glsl"
#endif

// Blinn's variant of Phong's model (Blinn 1977), as OpenGL's fixed function summed it (OpenGL 2.1, 2.14.1). Not
// reciprocal, and it does not claim to conserve energy.
//
// Units: the light's colour in OpenGL's sum is irradiance / pi here, so that a diffuse colour is an albedo, as in
// the other models, and ambient light of radiance a comes back as ambient * a.

struct BlinnPhong {
    Vec3 diffuse;    // d_P, linear
    Vec3 specular;   // s_P, linear
    Real shininess;  // s >= 0
};

// [n.l > 0] (n.h)^s with h = norm(v + l); 0 where light and eye are exactly opposite. Unit vectors that point away from
// the surface.
FORMULA_FN Real blinnPhongHighlight(Vec3 normal, Vec3 toLight, Vec3 toEye, Real shininess) {
    if (!(dot(normal, toLight) > REAL(0.0))) return REAL(0.0);
    Vec3 halfway = normalizeOr(toLight + toEye, Vec3(REAL(0.0)));
    if (!(lengthSquared(halfway) > REAL(0.0))) return REAL(0.0);
    return cosinePower(dot(normal, halfway), lengthSquared(cross(normal, halfway)), shininess);
}

// Radiance towards the eye per irradiance on a surface that faces the light, 1/sr: ((n.l) d_P + (n.h)^s s_P) / pi,
// both parts 0 unless n.l > 0.
FORMULA_FN Vec3 blinnPhongReflect(BlinnPhong material, Vec3 normal, Vec3 toLight, Vec3 toEye) {
    Real cosLight = max(dot(normal, toLight), REAL(0.0));
    Real highlight = blinnPhongHighlight(normal, toLight, toEye, material.shininess);
    return (material.diffuse * cosLight + material.specular * highlight) * kInversePi;
}

// Radiance towards the eye under the same radiance from everywhere: a_P a, dimmed by occlusion.
FORMULA_FN Vec3 blinnPhongAmbient(Vec3 ambient, Vec3 ambientRadiance, Real occlusion) {
    return ambient * ambientRadiance * occlusion;
}
