#pragma once

#include <bit>
#include <cstdint>

namespace umbriel {

// The float that a 16-bit float of IEEE 754 (binary16) is, to the bit: every half is a float. Denormals, infinities and
// the payloads of what is no number are kept. Without branches on the value, so that loops over pixels are vectors.
constexpr float floatFromHalf(std::uint16_t half) {
    const std::uint32_t sign = std::uint32_t{half & 0x8000u} << 16;
    const std::uint32_t rest = std::uint32_t{half & 0x7fffu} << 13;  // exponent and mantissa where a float has them
    const std::uint32_t exponent = rest & 0x0f800000u;
    // The exponents' biases are 15 and 127; infinities and no numbers go on to a float's largest exponent, 255.
    const std::uint32_t rebias = (exponent == 0x0f800000u ? 2u * (127u - 15u) : 127u - 15u) << 23;
    // A denormal is mantissa * 2^-24: with the exponent of 2^-14 it is that far above 2^-14, and the difference is
    // exact.
    const float denormal = std::bit_cast<float>(rest + (std::uint32_t{127 - 14} << 23)) - 0x1p-14f;
    const std::uint32_t magnitude = exponent == 0 ? std::bit_cast<std::uint32_t>(denormal) : rest + rebias;
    return std::bit_cast<float>(sign | magnitude);
}

}  // namespace umbriel
