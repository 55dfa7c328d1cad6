#pragma once

#include <bit>
#include <cstdint>

namespace umbriel::visibility {

// IEEE 754 binary16, rounded to nearest, ties to even; too large becomes infinity. Own code, so that files do not
// depend on a library's rounding.
inline std::uint16_t toHalf(float value) {
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(value);
    const auto sign = static_cast<std::uint16_t>(bits >> 16 & 0x8000u);
    const std::uint32_t magnitude = bits & 0x7fffffffu;
    if (magnitude > 0x7f800000u) return static_cast<std::uint16_t>(sign | 0x7e00u);   // NaN
    if (magnitude >= 0x477ff000u) return static_cast<std::uint16_t>(sign | 0x7c00u);  // rounds to 65536 or more
    if (magnitude < 0x33000001u) return sign;                                         // half of the smallest, or less
    const int exponent = static_cast<int>(magnitude >> 23) - 127;
    const std::uint32_t mantissa = (magnitude & 0x7fffffu) | 0x800000u;
    // Normal halfs keep 10 bits after the point; below 2^-14 one less for each power of two.
    const int drop = exponent >= -14 ? 13 : 13 + (-14 - exponent);
    const std::uint32_t kept = mantissa >> drop;
    const std::uint32_t rest = mantissa & ((1u << drop) - 1u);
    const std::uint32_t half = 1u << (drop - 1);
    const std::uint32_t rounded = kept + ((rest > half || (rest == half && (kept & 1u) != 0)) ? 1u : 0u);
    // The leading one of a normal number adds to the exponent, as does a carry.
    const std::uint32_t base = exponent >= -14 ? static_cast<std::uint32_t>(exponent + 14) << 10 : 0u;
    return static_cast<std::uint16_t>(sign | (base + rounded));
}

inline float fromHalf(std::uint16_t half) {
    const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000u) << 16;
    const std::uint32_t exponent = half >> 10 & 31u, mantissa = half & 1023u;
    if (exponent == 31) return std::bit_cast<float>(sign | 0x7f800000u | mantissa << 13);
    if (exponent == 0) {
        const float value = static_cast<float>(mantissa) * 0x1p-24f;
        return sign ? -value : value;
    }
    return std::bit_cast<float>(sign | (exponent + 112) << 23 | mantissa << 13);
}

}  // namespace umbriel::visibility
