#pragma once

#include <cstdint>
#include <vector>

#include "common/image/image.h"
#include "common/scene/aspect.h"
#include "common/scene/nodes.h"
#include "common/wall/view.h"

namespace umbriel {

// A picture as double precision would have it: every pixel shaded at its centre with the interpolated normal.
struct PictureTruth {
    FloatImage rgba;                   // pixels that are not judged are those of the picture
    std::vector<std::uint8_t> judged;  // by pixel, top row first
    double judgedShare = 0.0;          // of the pixels that show a surface
};

// The truth behind a picture that shows all of a view, one sample a pixel, with the layer "ids". Judged are opaque
// surfaces with normals, without textures; shadows and fog are left out, so the picture must be drawn without them.
// Every pixel's ray is intersected with the triangle that the layer names, in double.
PictureTruth truthOf(const Aspect& scene, Ref<Node> root, const View& view, const LayeredImage& picture);

}  // namespace umbriel
