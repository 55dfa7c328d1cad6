#pragma once

#include <cmath>

#include "common/math/glm.h"

namespace umbriel {

// target point = linear * source point + translation, in double.
struct Affine {
    glm::dmat3 linear{1.0};
    glm::dvec3 translation{0.0};

    glm::dvec3 point(const glm::dvec3& p) const { return linear * p + translation; }
    glm::dvec3 vector(const glm::dvec3& v) const { return linear * v; }
    friend bool operator==(const Affine&, const Affine&) = default;
};

// The right one acts first: worldFromChild = worldFromParent * parentFromChild.
inline Affine operator*(const Affine& outer, const Affine& inner) {
    return {outer.linear * inner.linear, outer.linear * inner.translation + outer.translation};
}

inline glm::dmat4 toMatrix(const Affine& affine) {
    glm::dmat4 matrix(affine.linear);
    matrix[3] = glm::dvec4(affine.translation, 1.0);
    return matrix;
}

inline bool isFinite(const glm::dvec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
inline bool isFinite(const glm::dmat3& m) {
    return isFinite(m[0]) && isFinite(m[1]) && isFinite(m[2]);
}
inline bool isFinite(const glm::dmat4& m) {
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row)
            if (!std::isfinite(m[column][row])) return false;
    return true;
}

}  // namespace umbriel
