#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/math/glm.h"

namespace umbriel {

// Three bytes a texel, first row on top.
struct TexelGrid {
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> rgb;
};

// texel(x, row) in [0,1] per channel: sRGB values for colours, plain ones for data.
TexelGrid makeTexels(int width, int height, const std::function<glm::vec3(int x, int row)>& texel);

// From heights (in texel widths) of a tiling surface: x right, y up, z out, in tangent space.
TexelGrid normalMapOf(int width, int height, const std::function<float(int x, int row)>& heightOf);

// Smooth random values in [0,1], repeating after period cells; four octaves.
float tilingNoise(float x, float y, int period, std::uint32_t seed);

// sRGB 0xRRGGBB as [0,1] per channel.
glm::vec3 srgb(std::uint32_t rgb);

}  // namespace umbriel
