#pragma once

#include <array>

#include "common/image/image.h"
#include "common/image/spread.h"

namespace umbriel {

// CIE 1976 L*a*b* (CIE 15:2004, 8.2.1) of a linear sRGB colour; white is D65, (1, 1, 1) is L* 100, a* 0, b* 0.
std::array<double, 3> labFromLinear(double red, double green, double blue);

// CIE 1976 colour difference (8.2.1.2): the distance in L*a*b*. About 2.3 is just noticeable (Mahy et al. 1994).
double deltaE(const std::array<double, 3>& labA, const std::array<double, 3>& labB);

// deltaE() over two pictures of one size (asserted) as a display shows them: times `scale` (exposureScale()), clamped
// to [0, 1]; NaN shows as 0. Spatial masking is not modelled: every pixel counts as if it filled the view.
Spread colourDifference(const FloatImage& a, const FloatImage& b, double scale);

}  // namespace umbriel
