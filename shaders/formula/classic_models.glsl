#ifndef __cplusplus
#include "formula/blinn_phong.glsl"
#include "formula/phong.glsl"
#endif

// The sums that textbooks print, in their own units: colours in, colours out, no pi. To draw them beside the physical
// models, a light's colour is its irradiance / pi (blinn_phong.glsl says the same). Directions as everywhere.

// a_P a (5.5): ambient light of colour a, reflected.
FORMULA_FN Vec3 ambientReflect(Vec3 ambient, Vec3 light) { return ambient * light; }

// max(n.l, 0) d_P d (5.7).
FORMULA_FN Vec3 diffuseReflect(Vec3 diffuse, Vec3 light, Vec3 normal, Vec3 toLight) {
    return diffuse * light * max(dot(normal, toLight), REAL(0.0));
}

// e e_P (5.5.4): the object's emission times the texel of its emission texture.
FORMULA_FN Vec3 emitted(Vec3 emission, Vec3 texel) { return emission * texel; }

// Phong's own combination (5.12; Phong 1975), under one light of colour 1: c ((n.l) (1 - d) + d) + s (r.v)^s. Ungated,
// as printed.
struct PhongOriginal {
    Vec3 colour;     // c_P
    Real ambient;    // d_P, [0, 1]: the share that needs no light
    Vec3 specular;   // s_P
    Real shininess;  // s >= 0
};

FORMULA_FN Vec3 phongOriginal(PhongOriginal material, Vec3 normal, Vec3 toLight, Vec3 toEye) {
    Real cosLight = max(dot(normal, toLight), REAL(0.0));
    return material.colour * (cosLight * (REAL(1.0) - material.ambient) + material.ambient) +
           material.specular * phongHighlight(normal, toLight, toEye, material.shininess);
}

// What the general sum and OpenGL's take.
struct ClassicMaterial {
    Vec3 ambient;    // a_P
    Vec3 diffuse;    // d_P
    Vec3 specular;   // s_P
    Real shininess;  // s >= 0
};

// One light's part of the general sum (5.13): a_P a_i + (n.l) d_P d_i + (r.v)^s s_P s_i. Ungated, as printed.
FORMULA_FN Vec3 generalSumTerm(ClassicMaterial material, Vec3 lightAmbient, Vec3 lightDiffuse, Vec3 lightSpecular,
                               Vec3 normal, Vec3 toLight, Vec3 toEye) {
    return ambientReflect(material.ambient, lightAmbient) +
           diffuseReflect(material.diffuse, lightDiffuse, normal, toLight) +
           material.specular * lightSpecular * phongHighlight(normal, toLight, toEye, material.shininess);
}

// One light's part of OpenGL's sum (5.7; OpenGL 2.1, 2.14.1):
// share (a_P a_i + (n.l) d_P c_i + [n.l > 0] (n.h)^s s_P c_i), share being attenuation times spot factor.
FORMULA_FN Vec3 openGlSumTerm(ClassicMaterial material, Vec3 lightAmbient, Vec3 lightColour, Real share, Vec3 normal,
                              Vec3 toLight, Vec3 toEye) {
    Real highlight = blinnPhongHighlight(normal, toLight, toEye, material.shininess);
    return (ambientReflect(material.ambient, lightAmbient) +
            diffuseReflect(material.diffuse, lightColour, normal, toLight) +
            material.specular * lightColour * highlight) * share;
}

// The whole of it: e e_P + t (a_P a_R + sum of the terms), with the texture's t and global ambient light a_R.
FORMULA_FN Vec3 openGlSum(Vec3 emission, Vec3 emissionTexel, Vec3 texel, Vec3 ambient, Vec3 globalAmbient,
                          Vec3 terms) {
    return emitted(emission, emissionTexel) + texel * (ambientReflect(ambient, globalAmbient) + terms);
}
