#include "common/image/display.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace umbriel {
namespace {

// Linear value at which the rounded code steps from k to k + 1. Comparing with these is the rounding itself, without
// a pow() per sample.
std::array<double, 255> makeThresholds() {
    std::array<double, 255> thresholds{};
    for (std::size_t k = 0; k < thresholds.size(); ++k) {
        thresholds[k] = linearFromSrgb((static_cast<double>(k) + 0.5) / 255.0);
    }
    return thresholds;
}

std::array<float, 256> makeDecoded() {
    std::array<float, 256> decoded{};
    for (std::size_t k = 0; k < decoded.size(); ++k) {
        decoded[k] = static_cast<float>(linearFromSrgb(static_cast<double>(k) / 255.0));
    }
    return decoded;
}

}  // namespace

double srgbFromLinear(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

double linearFromSrgb(double encoded) {
    return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

float linearFromSrgbByte(std::uint8_t code) {
    static const std::array<float, 256> decoded = makeDecoded();
    return decoded[code];
}

double exposureScale(double exposureValue) {
    return std::exp2(exposureValue);
}

std::uint8_t displayByte(float linear, double scale) {
    static const std::array<double, 255> thresholds = makeThresholds();
    const double value = static_cast<double>(linear) * scale;
    if (!(value > 0.0)) {  // also NaN
        return 0;
    }
    return static_cast<std::uint8_t>(std::upper_bound(thresholds.begin(), thresholds.end(), value) -
                                     thresholds.begin());
}

std::uint8_t alphaByte(float alpha) {
    if (!(alpha > 0.0F)) {
        return 0;
    }
    return static_cast<std::uint8_t>(std::floor(std::min(static_cast<double>(alpha), 1.0) * 255.0 + 0.5));
}

}  // namespace umbriel
