#include "client/import/procedural_texture.h"

#include <algorithm>
#include <cmath>

namespace umbriel {

namespace {

std::uint8_t toByte(float value) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0f, 1.0f) * 255.0f));
}

// A hash of lattice points (after Jarzynski & Olano 2020, pcg).
float latticeValue(std::uint32_t x, std::uint32_t y, std::uint32_t seed) {
    std::uint32_t state = (x * 1664525u + y * 22695477u + seed * 1013904223u) * 747796405u + 2891336453u;
    state = ((state >> ((state >> 28) + 4)) ^ state) * 277803737u;
    state = (state >> 22) ^ state;
    return static_cast<float>(state >> 8) * 0x1p-24f;
}

}  // namespace

TexelGrid makeTexels(int width, int height, const std::function<glm::vec3(int x, int row)>& texel) {
    TexelGrid grid{width, height, {}};
    grid.rgb.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
    for (int row = 0; row < height; ++row)
        for (int x = 0; x < width; ++x) {
            const glm::vec3 value = texel(x, row);
            grid.rgb.insert(grid.rgb.end(), {toByte(value.x), toByte(value.y), toByte(value.z)});
        }
    return grid;
}

TexelGrid normalMapOf(int width, int height, const std::function<float(int x, int row)>& heightOf) {
    return makeTexels(width, height, [&](int x, int row) {
        const float slopeX = 0.5f * (heightOf((x + 1) % width, row) - heightOf((x + width - 1) % width, row));
        const float slopeDown = 0.5f * (heightOf(x, (row + 1) % height) - heightOf(x, (row + height - 1) % height));
        return 0.5f + 0.5f * glm::normalize(glm::vec3(-slopeX, slopeDown, 1.0f));
    });
}

float tilingNoise(float x, float y, int period, std::uint32_t seed) {
    float sum = 0.0f;
    float weight = 0.5f;
    for (std::uint32_t octave = 0; octave < 4; ++octave) {
        const float floorX = std::floor(x);
        const float floorY = std::floor(y);
        float fractionX = x - floorX;
        float fractionY = y - floorY;
        fractionX = fractionX * fractionX * (3.0f - 2.0f * fractionX);
        fractionY = fractionY * fractionY * (3.0f - 2.0f * fractionY);
        const auto wrap = [period](int cell) {
            return static_cast<std::uint32_t>(((cell % period) + period) % period);
        };
        const auto at = [&](int dx, int dy) {
            return latticeValue(wrap(static_cast<int>(floorX) + dx), wrap(static_cast<int>(floorY) + dy),
                                seed + octave);
        };
        const float below = at(0, 0) + (at(1, 0) - at(0, 0)) * fractionX;
        const float above = at(0, 1) + (at(1, 1) - at(0, 1)) * fractionX;
        sum += weight * (below + (above - below) * fractionY);
        weight *= 0.5f;
        x *= 2.0f;
        y *= 2.0f;
        period *= 2;
    }
    return sum / 0.9375f;
}

glm::vec3 srgb(std::uint32_t rgb) {
    return glm::vec3(static_cast<float>((rgb >> 16) & 255), static_cast<float>((rgb >> 8) & 255),
                     static_cast<float>(rgb & 255)) /
           255.0f;
}

}  // namespace umbriel
