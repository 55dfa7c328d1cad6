#include "common/image/measures.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "common/image/display.h"
#include "tests/unit/image/test_files.h"

namespace umbriel {
namespace {

LayeredImage constant(int width, int height, float value) {
    LayeredImage image;
    image.rgba = FloatImage(width, height, {"R", "G", "B", "A"}, value);
    return image;
}

ImageComparison compare(const LayeredImage& a, const LayeredImage& b, double exposure = 0.0) {
    const Result<ImageComparison> result = compareImages(a, b, {exposure});
    EXPECT_TRUE(result.has_value());
    return result ? *result : ImageComparison{};
}

TEST(Measures, EqualPicturesDoNotDiffer) {
    const ImageComparison c = compare(constant(7, 5, 0.5F), constant(7, 5, 0.5F));
    EXPECT_EQ(c.pixels, 35U);
    EXPECT_EQ(c.differing + c.bitDiffering + c.over8 + c.holes + c.nonFinite, 0U);
    EXPECT_EQ(c.max, 0.0);
    EXPECT_EQ(c.mae, 0.0);
    EXPECT_EQ(c.rmse, 0.0);
}

// One pixel each: below 8-bit resolution, one code, far off, a hole, -0 against 0.
TEST(Measures, CountsAndMeansOfAHandMadePair) {
    LayeredImage a = constant(4, 2, 0.5F);
    LayeredImage b = a;
    b.rgba.at(0, 0, 0) = std::nextafter(0.5F, 1.0F);
    b.rgba.at(1, 0, 1) = linearFromSrgbByte(189);  // 0.5 is 188
    b.rgba.at(2, 0, 2) = 0.75F;                    // 0.25 off, 225 against 188
    b.rgba.at(3, 0, 3) = 0.0F;                     // alpha 128 against 0
    a.rgba.at(0, 1, 0) = 0.0F;
    b.rgba.at(0, 1, 0) = -0.0F;
    const ImageComparison c = compare(a, b);
    EXPECT_EQ(c.pixels, 8U);
    EXPECT_EQ(c.bitDiffering, 5U);
    EXPECT_EQ(c.differing, 3U);
    EXPECT_EQ(c.over8, 2U);
    EXPECT_EQ(c.holes, 1U);
    EXPECT_EQ(c.nonFinite, 0U);
    const double d0 = static_cast<double>(std::nextafter(0.5F, 1.0F)) - 0.5;
    const double d1 = static_cast<double>(linearFromSrgbByte(189)) - 0.5;
    EXPECT_EQ(c.max, 0.25);
    EXPECT_NEAR(c.mae, (d0 + d1 + 0.25) / 24.0, 1e-15);
    EXPECT_NEAR(c.rmse, std::sqrt((d0 * d0 + d1 * d1 + 0.0625) / 24.0), 1e-15);
}

TEST(Measures, EightCodesAreNotMoreThanEight) {
    LayeredImage a = constant(2, 1, 0.0F);
    LayeredImage b = a;
    a.rgba.at(0, 0, 0) = linearFromSrgbByte(100);
    b.rgba.at(0, 0, 0) = linearFromSrgbByte(108);
    EXPECT_EQ(compare(a, b).over8, 0U);
    b.rgba.at(0, 0, 0) = linearFromSrgbByte(109);
    EXPECT_EQ(compare(a, b).over8, 1U);
    EXPECT_EQ(compare(b, a).over8, 1U);
}

TEST(Measures, ExposureDecidesWhatIsSeen) {
    LayeredImage a = constant(1, 1, 1.0F);
    LayeredImage b = constant(1, 1, 1.0F);
    a.rgba.at(0, 0, 0) = 2.0F;
    b.rgba.at(0, 0, 0) = 4.0F;
    EXPECT_EQ(compare(a, b).differing, 0U);         // both clamp to white
    EXPECT_EQ(compare(a, b, -2.0).differing, 1U);   // 0.5 and 1
    EXPECT_EQ(compare(a, b, -30.0).differing, 0U);  // both black
    EXPECT_EQ(compare(a, b, -2.0).max, 2.0);        // linear measures are not exposed
}

TEST(Measures, AlphaIsNotExposed) {
    LayeredImage a = constant(1, 1, 0.0F);
    LayeredImage b = constant(1, 1, 0.0F);
    a.rgba.at(0, 0, 3) = 0.5F;
    b.rgba.at(0, 0, 3) = 1.0F;
    const ImageComparison c = compare(a, b, -30.0);
    EXPECT_EQ(c.differing, 1U);
    EXPECT_EQ(c.holes, 0U);
    EXPECT_EQ(c.max, 0.0);
}

TEST(Measures, NanDiffersEvenFromItselfAndPoisonsNoMean) {
    LayeredImage a = constant(2, 2, 0.25F);
    LayeredImage b = a;
    a.rgba.at(0, 0, 1) = std::nanf("1");
    b.rgba.at(0, 0, 1) = std::nanf("1");
    b.rgba.at(1, 1, 2) = std::nanf("");
    b.rgba.at(1, 0, 0) = 0.5F;
    const ImageComparison c = compare(a, b);
    EXPECT_EQ(c.bitDiffering, 3U);
    EXPECT_EQ(c.differing, 3U);
    EXPECT_EQ(c.nonFinite, 2U);
    EXPECT_EQ(c.max, 0.25);
    EXPECT_EQ(c.mae, 0.25 / 6.0);
}

TEST(Measures, InfinityIsWhiteAndLeftOutOfTheMeans) {
    const float infinity = std::numeric_limits<float>::infinity();
    LayeredImage a = constant(3, 1, 1.0F);
    LayeredImage b = a;
    a.rgba.at(0, 0, 0) = infinity;
    b.rgba.at(0, 0, 0) = infinity;  // the same: differs in nothing
    b.rgba.at(1, 0, 0) = infinity;  // shows as 1 does
    b.rgba.at(2, 0, 0) = -infinity;
    const ImageComparison c = compare(a, b);
    EXPECT_EQ(c.bitDiffering, 2U);
    EXPECT_EQ(c.differing, 1U);
    EXPECT_EQ(c.over8, 1U);
    EXPECT_EQ(c.nonFinite, 3U);
    EXPECT_EQ(c.max, 0.0);
    EXPECT_EQ(c.rmse, 0.0);
}

TEST(Measures, LargestFloatsDoNotOverflow) {
    const LayeredImage a = constant(2, 1, std::numeric_limits<float>::max());
    const LayeredImage b = constant(2, 1, -std::numeric_limits<float>::max());
    const ImageComparison c = compare(a, b);
    EXPECT_EQ(c.max, 2.0 * static_cast<double>(std::numeric_limits<float>::max()));
    EXPECT_NEAR(c.rmse / c.max, 1.0, 1e-15);
}

TEST(Measures, UnequalSizesAreBadInput) {
    const Result<ImageComparison> result = compareImages(constant(2, 3, 0.0F), constant(3, 2, 0.0F));
    ASSERT_FALSE(result.has_value());
    EXPECT_EQ(result.error().kind, Error::Kind::BadInput);
    EXPECT_NE(result.error().message.find("2 x 3"), std::string::npos);
    EXPECT_NE(result.error().message.find("3 x 2"), std::string::npos);
}

// Whatever the bits: counts do not depend on the order of the pair, tiles add up to the whole, and the kinds nest.
RC_GTEST_PROP(Measures, AreSymmetricAndAddUpOverTiles, ()) {
    const int width = *rc::gen::inRange(1, 20);
    const int height = *rc::gen::inRange(1, 20);
    const int split = *rc::gen::inRange(0, width + 1);
    std::mt19937_64 random(*rc::gen::arbitrary<std::uint64_t>());
    LayeredImage a = constant(width, height, 0.0F);
    test::fillWithAnyBits(a.rgba, random);
    LayeredImage b = a;
    for (float& sample : b.rgba.samples()) {
        if (random() % 8 == 0) {
            sample = static_cast<float>(random() % 1000) / 500.0F;
        }
    }
    const ImageComparison ab = *compareImages(a, b);
    const ImageComparison ba = *compareImages(b, a);
    const ImageComparison left = compareRegion(a.rgba, b.rgba, {0, 0, split, height});
    const ImageComparison right = compareRegion(a.rgba, b.rgba, {split, 0, width - split, height});
    const auto counts = [](const ImageComparison& c) {
        return std::array{c.pixels, c.differing, c.bitDiffering, c.over8, c.holes, c.nonFinite};
    };
    RC_ASSERT(counts(ab) == counts(ba));
    RC_ASSERT(ab.max == ba.max && ab.mae == ba.mae && ab.rmse == ba.rmse);
    for (std::size_t i = 0; i < counts(ab).size(); ++i) {
        RC_ASSERT(counts(ab)[i] == counts(left)[i] + counts(right)[i]);
    }
    RC_ASSERT(ab.max == std::max(left.max, right.max));
    RC_ASSERT(ab.over8 <= ab.differing && ab.differing <= ab.bitDiffering && ab.bitDiffering <= ab.pixels);
    RC_ASSERT(std::isfinite(ab.max) && std::isfinite(ab.mae) && std::isfinite(ab.rmse));
    RC_ASSERT(ab.mae <= ab.rmse * (1.0 + 1e-12) && ab.rmse <= ab.max * (1.0 + 1e-12));
}

TEST(Measures, LayersAreComparedByBitsAndMissingOnesNamed) {
    LayeredImage a = constant(2, 2, 0.0F);
    LayeredImage b = a;
    UintImage ids(2, 2, {"node", "primitive"});
    a.layers.push_back({"ids", ids});
    ids.at(1, 1, 1) = 5;
    ids.at(0, 0, 0) = 0x7fc00000;  // an id, not a NaN
    b.layers.push_back({"ids", ids});
    FloatImage depth(2, 2, {"Z"}, std::numeric_limits<float>::infinity());
    depth.at(0, 0, 0) = std::nanf("");
    a.layers.push_back({"depth", depth});
    b.layers.push_back({"depth", depth});
    a.layers.push_back({"normal", FloatImage(2, 2, {"X", "Y", "Z"})});
    b.layers.push_back({"position", FloatImage(2, 2, {"X", "Y", "Z"})});
    a.layers.push_back({"light", FloatImage(2, 2, {"factor"})});
    b.layers.push_back({"light", FloatImage(2, 2, {"radiance"})});
    const ImageComparison c = compare(a, b);
    EXPECT_EQ(c.bitDiffering, 0U);
    using Presence = LayerComparison::Presence;
    ASSERT_EQ(c.layers.size(), 5U);
    EXPECT_EQ(c.layers[0].name, "depth");
    EXPECT_EQ(c.layers[0].bitDiffering, 1U);
    EXPECT_EQ(c.layers[1].name, "ids");
    EXPECT_TRUE(c.layers[1].isUint);
    EXPECT_EQ(c.layers[1].bitDiffering, 2U);
    EXPECT_EQ(c.layers[2].presence, Presence::OtherChannels);
    EXPECT_EQ(c.layers[3].name, "normal");
    EXPECT_EQ(c.layers[3].presence, Presence::OnlyA);
    EXPECT_EQ(c.layers[4].name, "position");
    EXPECT_EQ(c.layers[4].presence, Presence::OnlyB);
}

TEST(WorstPixels, AreSortedAndCut) {
    const LayeredImage a = constant(3, 2, 0.0F);
    LayeredImage b = a;
    b.rgba.at(2, 1, 0) = 0.5F;
    b.rgba.at(1, 0, 0) = 1.0F;
    b.rgba.at(0, 1, 2) = 1.0F;
    b.rgba.at(0, 0, 0) = 1e-9F;
    b.rgba.at(2, 0, 1) = std::nanf("");
    const auto worst = worstPixels(a.rgba, b.rgba, {0, 0, 3, 2}, 4);
    ASSERT_EQ(worst.size(), 4U);
    const auto at = [&](std::size_t i) { return std::pair(worst[i].x, worst[i].y); };
    EXPECT_TRUE(worst[0].hasNan);
    EXPECT_EQ(at(0), std::pair(2, 0));
    EXPECT_EQ(at(1), std::pair(1, 0));
    EXPECT_EQ(at(2), std::pair(0, 1));
    EXPECT_EQ(worst[2].bytes, 255);
    EXPECT_EQ(worst[2].b[2], 1.0F);
    EXPECT_EQ(at(3), std::pair(2, 1));
    EXPECT_EQ(worst[3].linear, 0.5);
    EXPECT_EQ(worstPixels(a.rgba, b.rgba, {0, 0, 3, 2}, 99).size(), 5U);
    EXPECT_EQ(worstPixels(a.rgba, b.rgba, {0, 1, 3, 1}, 99).size(), 2U);
    EXPECT_TRUE(worstPixels(a.rgba, b.rgba, {0, 0, 3, 2}, 0).empty());
}

}  // namespace
}  // namespace umbriel
