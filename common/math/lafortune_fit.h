#pragma once

#include <vector>

#include "common/base/result.h"
#include "common/math/brdf_table.h"
#include "common/math/glm.h"

namespace umbriel {

// Lafortune et al. 1997, "Non-Linear Approximation of Reflectance Functions", isotropic:
//   f(u, v) = diffuse / pi + sum_j weight_j max(planar_j (u.x v.x + u.y v.y) + normal_j u.z v.z, 0)^exponent_j
// with u, v the directions to light and eye, local (+Z the normal). planar = -1, normal = 1 is Phong's lobe, planar > 0
// reflects back, normal > -planar peaks off the mirror direction. The paper's own C_x = C_y and C_z are planar and
// normal times weight^(1 / exponent), each channel by itself; here the shape is common to the channels.
struct LafortuneLobe {
    double planar = -1.0;  // planar^2 + normal^2 = 2, normal >= 0
    double normal = 1.0;
    double exponent = 1.0;   // 1 to 16384
    glm::dvec3 weight{0.0};  // linear R, G, B, not negative
};

// A BRDF of a diffuse part and lobes (Lafortune et al. 1997).
struct LafortuneModel {
    glm::dvec3 diffuse{0.0};  // albedo, not negative
    std::vector<LafortuneLobe> lobes;

    // 1/sr; 0 below the surface. Reciprocal by construction.
    glm::dvec3 value(const glm::dvec3& inLocal, const glm::dvec3& outLocal) const;
};

// A fitted model, and what it leaves of the table.
struct LafortuneFit {
    LafortuneModel model;
    // Root of the mean square of the error over that of the table, each channel (0 where the table is 0), over both
    // hemispheres of projected solid angle: what counts in a picture, grazing angles little.
    glm::dvec3 residual{0.0};
};

constexpr int kMaxLafortuneLobes = 3;

// Fits `lobes` lobes (1 to 3) and the diffuse part. Weights are linear least squares without negative ones, solved
// exactly for each shape; shapes come one lobe after the other from a fixed lattice and are then moved together by
// pattern search (Hooke and Jeeves 1961). A local minimum; the same table gives the same bits.
// Bad input: what checkBrdfTable() refuses, a table of zeros, another number of lobes.
Result<LafortuneFit> fitLafortune(const BrdfTable& table, int lobes);

}  // namespace umbriel
