#include "common/image/tone_mapping.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/image/display.h"
#include "common/image/png_io.h"
#include "tests/unit/image/test_files.h"

namespace umbriel {
namespace {

constexpr ToneMapping kAll[] = {ToneMapping::Clamp, ToneMapping::Exponential, ToneMapping::Reinhard,
                                ToneMapping::AcesNarkowicz};

TEST(ToneMapping, HasTheValuesOfItsSources) {
    EXPECT_EQ(toneMapped(ToneMapping::Clamp, 0.25), 0.25);
    EXPECT_EQ(toneMapped(ToneMapping::Clamp, 7.0), 1.0);
    EXPECT_NEAR(toneMapped(ToneMapping::Exponential, std::log(2.0)), 0.5, 1e-15);
    EXPECT_EQ(toneMapped(ToneMapping::Reinhard, 1.0), 0.5);
    EXPECT_EQ(toneMapped(ToneMapping::Reinhard, 3.0), 0.75);
    EXPECT_NEAR(toneMapped(ToneMapping::AcesNarkowicz, 1.0), 2.54 / 3.16, 1e-15);
    // Where the fit reaches 1: 0.08 x^2 - 0.56 x - 0.14 = 0.
    const double white = (0.56 + std::sqrt(0.56 * 0.56 + 4.0 * 0.08 * 0.14)) / 0.16;
    EXPECT_LT(toneMapped(ToneMapping::AcesNarkowicz, white * 0.999), 1.0);
    EXPECT_EQ(toneMapped(ToneMapping::AcesNarkowicz, white * 1.001), 1.0);
}

// From the smallest denormal to beyond the largest float, 200 steps a decade.
TEST(ToneMapping, StartsAtZeroRisesAndStaysBelowOne) {
    for (const ToneMapping operation : kAll) {
        EXPECT_EQ(toneMapped(operation, 0.0), 0.0);
        EXPECT_EQ(toneMapped(operation, -0.0), 0.0);
        EXPECT_EQ(toneMapped(operation, -1.0), 0.0);
        EXPECT_EQ(toneMapped(operation, std::nan("")), 0.0);
        EXPECT_EQ(toneMapped(operation, std::numeric_limits<double>::infinity()), 1.0);
        double last = 0.0;
        for (int i = -45 * 200; i <= 40 * 200; ++i) {
            const double x = std::pow(10.0, i / 200.0);
            const double mapped = toneMapped(operation, x);
            ASSERT_GE(mapped, last * (1.0 - 0x1p-52)) << x;  // x / (1 + x) is rounded twice
            ASSERT_LE(mapped, 1.0) << x;
            ASSERT_TRUE(mapped > last || mapped > 0.999) << "flat before white at " << x;
            last = mapped;
        }
    }
}

TEST(ToneMapping, IsNamed) {
    EXPECT_EQ(toneMappingNamed("clamp"), ToneMapping::Clamp);
    EXPECT_EQ(toneMappingNamed("exposure"), ToneMapping::Exponential);
    EXPECT_EQ(toneMappingNamed("reinhard"), ToneMapping::Reinhard);
    EXPECT_EQ(toneMappingNamed("aces"), ToneMapping::AcesNarkowicz);
    EXPECT_FALSE(toneMappingNamed("ACES").has_value());
}

// Reinhard of 1 is 0.5, which is code 188; one stop of exposure makes it 2/3: 213.
TEST(ToneMapping, PngAppliesItAfterExposure) {
    const test::TemporaryFolder folder;
    FloatImage picture(2, 1, {"R", "G", "B", "A"}, 1.0F);
    picture.at(1, 0, 0) = std::numeric_limits<float>::infinity();
    const auto codeAt = [&](double exposure, ToneMapping operation, int x) {
        EXPECT_TRUE(writePng(folder / "a.png", picture, {.exposure = exposure, .toneMapping = operation}).has_value());
        const Result<LayeredImage> read = readPng(folder / "a.png");
        EXPECT_TRUE(read.has_value());
        return read ? displayByte(read->rgba.at(x, 0, 0), 1.0) : std::uint8_t{0};
    };
    EXPECT_EQ(codeAt(0.0, ToneMapping::Clamp, 0), 255);
    EXPECT_EQ(codeAt(0.0, ToneMapping::Reinhard, 0), 188);
    EXPECT_EQ(codeAt(1.0, ToneMapping::Reinhard, 0), 213);
    EXPECT_EQ(codeAt(1.0, ToneMapping::Reinhard, 1), 255);
}

}  // namespace
}  // namespace umbriel
