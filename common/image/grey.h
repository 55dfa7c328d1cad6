#pragma once

#include "common/image/image.h"

namespace umbriel {

// A picture with one channel "Y": the grey a display shows. Relative luminance (Rec. 709) of the exposed colours, each
// clamped to [0, 1], then encoded as sRGB, so that equal steps look roughly equal. NaN counts as 0, as on the display.
// `scale` is exposureScale() of display.h.
FloatImage displayGrey(const FloatImage& rgba, double scale);

}  // namespace umbriel
