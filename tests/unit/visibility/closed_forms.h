#pragma once

#include <cstdint>

#include "common/visibility/mapping.h"

namespace umbriel::visibility::test {

// Root mean square error of ambient occlusion, as a share of the open sky, from masks of occluders with a known answer:
// a wall of endless length whose top is seen k = height / distance high hides 1/2 (1 - 1/sqrt(1 + k^2)); a round cap of
// half angle sigma, above the horizon, whose middle is theta off the normal hides sin^2(sigma) cos(theta). Occluders
// are drawn from a fixed sequence, evenly over their angles. Weights are the exact ones, divided by their sum.
// Octahedral: against the normal (1, 2, 3) / sqrt(14), as its frame is not the vertex's.
struct FormErrors {
    double wall = 0.0;
    double cap = 0.0;
};
FormErrors formErrors(const Mapping& mapping, std::uint32_t occluders = 3000);

}  // namespace umbriel::visibility::test
