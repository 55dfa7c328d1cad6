#pragma once

#include <optional>

#include "common/math/glm.h"

namespace umbriel {

// A rotation whose columns are the world's x (right), y (up) and z (backward) axes of something that looks along
// forward with up above it. Neither needs unit length. When up is (nearly, within 1e-6 rad) parallel to forward, the
// world axis least parallel to forward takes its place. Nothing when forward is zero, not finite, or up is not finite.
std::optional<glm::dmat3> rotationLookingAlong(const glm::dvec3& forward, const glm::dvec3& up);

// The rotation nearest in meaning to a camera's or light's frame: keeps the direction of its -z column, and +y above it
// as far as that allows (Gram-Schmidt, z before y before x). Scale, shear and mirroring are dropped. Nothing when z
// vanishes or anything is not finite.
std::optional<glm::dmat3> orthonormalised(const glm::dmat3& frame);

}  // namespace umbriel
