#include "common/math/half.h"

#include <gtest/gtest.h>

#include <cmath>

namespace umbriel {
namespace {

// By the definition of IEEE 754: (-1)^s 2^(e - 15) (1 + m / 1024), with e = 0: (-1)^s 2^-14 (m / 1024).
TEST(Half, EveryOfThe65536IsTheFloatOfItsDefinition) {
    for (std::uint32_t bits = 0; bits < 65536; ++bits) {
        const float found = floatFromHalf(static_cast<std::uint16_t>(bits));
        const std::uint32_t exponent = bits >> 10 & 31u;
        const std::uint32_t mantissa = bits & 1023u;
        const auto foundBits = std::bit_cast<std::uint32_t>(found);
        ASSERT_EQ(foundBits >> 31, bits >> 15) << bits;
        if (exponent == 31) {
            ASSERT_EQ(std::isinf(found), mantissa == 0) << bits;
            ASSERT_EQ(foundBits & 0x7fffffffu, 0x7f800000u | mantissa << 13) << bits << ": the payload is kept";
            continue;
        }
        const double magnitude =
            exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024.0 + mantissa, static_cast<int>(exponent) - 25);
        ASSERT_EQ(static_cast<double>(found), bits >> 15 != 0 ? -magnitude : magnitude) << bits;
    }
}

TEST(Half, KnownValues) {
    static_assert(floatFromHalf(0x3c00) == 1.0f);
    static_assert(floatFromHalf(0xc000) == -2.0f);
    static_assert(floatFromHalf(0x7bff) == 65504.0f);
    static_assert(floatFromHalf(0x0400) == 0x1p-14f);
    static_assert(floatFromHalf(0x0001) == 0x1p-24f);
    EXPECT_TRUE(std::signbit(floatFromHalf(0x8000)));
    EXPECT_EQ(floatFromHalf(0x8000), 0.0f);
}

}  // namespace
}  // namespace umbriel
