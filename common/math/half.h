#pragma once

#include <bit>
#include <cstdint>

namespace umbriel {

// The float that a 16-bit float of IEEE 754 (binary16) is, to the bit: every half is a float. Denormals, infinities and
// the payloads of what is no number are kept. Without branches and without denormal floats, so that loops over pixels
// are vectors and dark ones as quick as others.
constexpr float floatFromHalf(std::uint16_t half) {
    const std::uint32_t sign = std::uint32_t{half & 0x8000u} << 16;
    const std::uint32_t rest = half & 0x7fffu;
    // The biases of the exponents are 15 and 127; the largest, of infinities and no numbers, goes on to the largest.
    const std::uint32_t isBeyond = 0u - std::uint32_t{rest >= 0x7c00u};
    const std::uint32_t normal = (rest << 13) + (112u << 23) + (isBeyond & (112u << 23));
    const auto denormal = std::bit_cast<std::uint32_t>(static_cast<float>(static_cast<std::int32_t>(rest)) * 0x1p-24f);
    const std::uint32_t isDenormal = 0u - std::uint32_t{rest < 0x0400u};
    return std::bit_cast<float>(sign | (denormal & isDenormal) | (normal & ~isDenormal));
}

}  // namespace umbriel
