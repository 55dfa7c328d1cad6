#include "common/image/display.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace umbriel {
namespace {

// IEC 61966-2-1: the two pieces meet at 0.0031308 -> 0.04045, and the published value of middle grey.
TEST(Display, SrgbHasTheStandardsValues) {
    EXPECT_EQ(srgbFromLinear(0.0), 0.0);
    EXPECT_NEAR(srgbFromLinear(1.0), 1.0, 1e-15);
    EXPECT_NEAR(srgbFromLinear(0.0031308), 0.040449936, 1e-9);
    EXPECT_NEAR(srgbFromLinear(0.18), 0.461356129500442, 1e-12);
    EXPECT_NEAR(linearFromSrgb(0.5), 0.214041140482232, 1e-12);
    EXPECT_EQ(linearFromSrgb(0.03), 0.03 / 12.92);
}

TEST(Display, EveryCodeSurvivesDecodingAndEncoding) {
    for (int code = 0; code < 256; ++code) {
        EXPECT_EQ(displayByte(linearFromSrgbByte(static_cast<std::uint8_t>(code)), 1.0), code);
    }
}

TEST(Display, CodesStepAtHalvesOfTheEncodedValue) {
    for (int code = 0; code < 255; ++code) {
        const double step = linearFromSrgb((code + 0.5) / 255.0);
        EXPECT_EQ(displayByte(static_cast<float>(step * (1.0 - 1e-6)), 1.0), code);
        EXPECT_EQ(displayByte(static_cast<float>(step * (1.0 + 1e-6)), 1.0), code + 1);
    }
}

RC_GTEST_PROP(Display, ByteIsTheRoundedEncodedClampedExposedValue, ()) {
    const double linear = static_cast<double>(*rc::gen::inRange(0, 1 << 22)) / (1 << 21);
    const int exposure = *rc::gen::inRange(-6, 7);
    const auto value = static_cast<float>(linear);
    const double scale = exposureScale(exposure);
    const double encoded = 255.0 * srgbFromLinear(std::clamp(value * scale, 0.0, 1.0));
    // At a step exactly, the two formulas may round apart.
    RC_PRE(std::abs(encoded - std::floor(encoded) - 0.5) > 1e-9);
    RC_ASSERT(int{displayByte(value, scale)} == static_cast<int>(std::floor(encoded + 0.5)));
}

TEST(Display, OutOfRangeAndNonFiniteAreClamped) {
    const float infinity = std::numeric_limits<float>::infinity();
    EXPECT_EQ(displayByte(std::nanf("1"), 1.0), 0);
    EXPECT_EQ(displayByte(-std::nanf("1"), 1.0), 0);
    EXPECT_EQ(displayByte(infinity, 1.0), 255);
    EXPECT_EQ(displayByte(-infinity, 1.0), 0);
    EXPECT_EQ(displayByte(-1.0F, 1.0), 0);
    EXPECT_EQ(displayByte(-0.0F, 1.0), 0);
    EXPECT_EQ(displayByte(std::numeric_limits<float>::denorm_min(), 1.0), 0);
    EXPECT_EQ(displayByte(std::numeric_limits<float>::max(), exposureScale(126.0)), 255);
    EXPECT_EQ(alphaByte(std::nanf("1")), 0);
    EXPECT_EQ(alphaByte(infinity), 255);
    EXPECT_EQ(alphaByte(-1.0F), 0);
}

TEST(Display, AlphaIsLinear) {
    EXPECT_EQ(alphaByte(0.5F), 128);  // 127.5 rounds up
    EXPECT_EQ(alphaByte(1.0F), 255);
    EXPECT_EQ(alphaByte(2.0F), 255);
    EXPECT_EQ(alphaByte(0.25F), 64);
}

TEST(Display, ExposureCountsInStops) {
    EXPECT_EQ(exposureScale(0.0), 1.0);
    EXPECT_EQ(exposureScale(3.0), 8.0);
    EXPECT_EQ(displayByte(0.125F, exposureScale(3.0)), 255);
}

}  // namespace
}  // namespace umbriel
