#pragma once

#include <cstdint>
#include <vector>

#include "common/scene/windows.h"

namespace umbriel {

// Radii of the filter over shadow factors beyond this are cut: a tile draws as many pixels around itself.
inline constexpr float kLargestGauss = 32.0f;

// The screen-space path of a viewport's shadows: factors of the opaque surfaces are drawn into a map of pixels,
// filtered there, and read by the surfaces' own shaders. Resolved from the viewport's fields; the same for client and
// servers.
struct ScreenShadow {
    bool factors = false;        // there is such a map
    bool edges = false;          // and one of the edges
    bool surfaces = false;       // where the visible surfaces lie and how they face is kept, for edges and seen areas
    float radius = 0.0f;         // pixels of the wall, of the filter; 0: none
    float edgeThreshold = 0.0f;  // share of the distance from the eye; 0: the filter knows no edges
    // How many pixels beyond a tile decide about it.
    std::int32_t reach() const;
};
ScreenShadow screenShadowOf(const Viewport& viewport);

// Half of a Gauss filter, from the centre outwards: weights of whole pixels up to the radius, whose half is the
// standard deviation. The whole filter's weights sum to 1 (Hempe's of 7.3.2 to 1.066). Radius 0: the centre alone.
std::vector<float> gaussWeights(float radius);

}  // namespace umbriel
