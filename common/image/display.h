#pragma once

#include <cstdint>

namespace umbriel {

// The display transform of PNG files and of the comparison measures: times 2^EV, clamp to [0, 1], sRGB encoding,
// rounding to 8 bits (halves up). NaN and everything below 0 show as 0, +inf as 255, which is what a GL clamp does.

// IEC 61966-2-1, piecewise; `linear` in [0, 1].
double srgbFromLinear(double linear);
// Its inverse; `encoded` in [0, 1].
double linearFromSrgb(double encoded);

// The linear value of an 8-bit sRGB code, rounded to float. displayByte(linearFromSrgbByte(k), 1) == k.
float linearFromSrgbByte(std::uint8_t code);

// 2^EV; 1 for EV 0, exactly.
double exposureScale(double exposureValue);

// One colour channel (already premultiplied: it shows over black).
std::uint8_t displayByte(float linear, double scale);

// Coverage is not a light: clamp and round only.
std::uint8_t alphaByte(float alpha);

}  // namespace umbriel
