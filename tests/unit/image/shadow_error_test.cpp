#include "common/image/shadow_error.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

namespace umbriel {
namespace {

constexpr int kWidth = 40, kHeight = 30;
constexpr std::size_t kPixels = kWidth * kHeight;

// Lit from column `edge` on.
std::vector<float> litFrom(double edge, double penumbra = 0.0) {
    std::vector<float> factors(kPixels);
    for (std::size_t i = 0; i < kPixels; ++i) {
        const double x = static_cast<double>(i % kWidth) + 0.5;
        factors[i] = penumbra > 0.0 ? static_cast<float>(std::clamp((x - edge) / penumbra + 0.5, 0.0, 1.0))
                                    : (x > edge ? 1.0f : 0.0f);
    }
    return factors;
}
const std::vector<std::uint8_t> kAll(kPixels, 1);

ShadowFactors factorsOf(const std::vector<float>& truth, const std::vector<float>& result,
                        const std::vector<std::uint8_t>& judged = kAll) {
    return {kWidth, kHeight, truth, result, judged};
}

TEST(ShadowError, AMovedEdgeIsALeakOrAcneOfItsArea) {
    const auto truth = litFrom(20), leaking = litFrom(17), dark = litFrom(22);
    const ShadowError leak = shadowError(factorsOf(truth, leaking));
    EXPECT_EQ(leak.judged, kPixels);
    EXPECT_DOUBLE_EQ(leak.leak, 3.0 / kWidth);
    EXPECT_EQ(leak.acne, 0.0);
    EXPECT_DOUBLE_EQ(leak.rmse, std::sqrt(3.0 / kWidth));
    EXPECT_DOUBLE_EQ(leak.wrongSide, 3.0 / kWidth);
    const ShadowError acne = shadowError(factorsOf(truth, dark));
    EXPECT_DOUBLE_EQ(acne.acne, 2.0 / kWidth);
    EXPECT_EQ(acne.leak, 0.0);
    EXPECT_DOUBLE_EQ(acne.error(), 2.0 / kWidth);
}

// Pixels with centres more than 2 pixels from the edge at x = 20 are the columns 0..17 and 22..39, of which 17 leaks.
TEST(ShadowError, AwayFromEdgesLeavesThemOut) {
    const auto truth = litFrom(20), result = litFrom(17);
    const ShadowError error = shadowError(factorsOf(truth, result));
    EXPECT_EQ(error.judgedAway, 36u * kHeight);
    EXPECT_DOUBLE_EQ(error.leakAway, 1.0 / 36.0);
    EXPECT_EQ(shadowError(factorsOf(truth, litFrom(18))).errorAway(), 0.0);
}

TEST(ShadowError, OnlyJudgedPixelsCount) {
    const auto truth = litFrom(20), result = litFrom(10);
    std::vector<std::uint8_t> judged(kPixels, 0);
    for (std::size_t i = 0; i < kPixels; ++i) judged[i] = i % kWidth >= 18 ? 1 : 0;
    const ShadowError error = shadowError(factorsOf(truth, result, judged));
    EXPECT_EQ(error.judged, 22u * kHeight);
    EXPECT_DOUBLE_EQ(error.leak, 2.0 / 22.0);
    const std::vector<std::uint8_t> none(kPixels, 0);
    EXPECT_EQ(shadowError(factorsOf(truth, result, none)).error(), 0.0);
}

TEST(ShadowError, APenumbraCountsByItsPart) {
    // Half of the light everywhere.
    const std::vector<float> truth(kPixels, 0.5f), lit(kPixels, 1.0f), dark(kPixels, 0.0f);
    EXPECT_DOUBLE_EQ(shadowError(factorsOf(truth, lit)).leak, 0.5);
    EXPECT_DOUBLE_EQ(shadowError(factorsOf(truth, dark)).acne, 0.5);
    EXPECT_DOUBLE_EQ(shadowError(factorsOf(truth, dark)).rmse, 0.5);
}

TEST(ShadowEdges, AnEdgeMovedByNPixelsIsNPixelsAway) {
    const auto truth = litFrom(20);
    for (const int moved : {0, 1, 5}) {
        const ShadowEdges edges = shadowEdges(factorsOf(truth, litFrom(20 + moved)));
        EXPECT_EQ(edges.inTruth, static_cast<std::uint64_t>(kHeight));
        EXPECT_EQ(edges.inResult, static_cast<std::uint64_t>(kHeight));
        EXPECT_EQ(edges.distance.median, moved);
        EXPECT_EQ(edges.distance.percentile95, moved);
    }
}

TEST(ShadowEdges, AMissingEdgeIsInfinitelyFarAndNoEdgesAreNot) {
    const auto truth = litFrom(20);
    const std::vector<float> lit(kPixels, 1.0f);
    EXPECT_TRUE(std::isinf(shadowEdges(factorsOf(truth, lit)).distance.median));
    EXPECT_TRUE(std::isinf(shadowEdges(factorsOf(lit, truth)).distance.median));
    EXPECT_EQ(shadowEdges(factorsOf(lit, lit)).distance.median, 0.0);
}

// The middle of a linear penumbra is where its hard edge is.
TEST(ShadowEdges, AreWhereHalfOfTheLightArrives) {
    EXPECT_EQ(shadowEdges(factorsOf(litFrom(20), litFrom(20, 8.0))).distance.percentile95, 0.0);
}

TEST(SeamJump, CountsWhatDiffersAcrossABorderOnly) {
    const std::vector<float> truth(kPixels, 1.0f);
    // 4 columns of 10: dark in the second one.
    std::vector<float> result(kPixels, 1.0f);
    for (std::size_t i = 0; i < kPixels; ++i)
        if (i % kWidth >= 10 && i % kWidth < 20) result[i] = 0.0f;
    const SeamJump seams = seamJump(factorsOf(truth, result), 4, 1);
    EXPECT_EQ(seams.pairs, 3u * kHeight);
    EXPECT_EQ(seams.jumps, 2u * kHeight);
    EXPECT_EQ(seamJump(factorsOf(truth, result), 1, 3).jumps, 0u);
    EXPECT_EQ(seamJump(factorsOf(truth, result), 1, 3).pairs, 2u * kWidth);
    // A true edge on the border is no jump.
    EXPECT_EQ(seamJump(factorsOf(litFrom(10), litFrom(10)), 4, 1).jumps, 0u);
    EXPECT_EQ(seamJump(factorsOf(truth, result), 1, 1).pairs, 0u);
}

TEST(SeamJump, RowsCountFromBelow) {
    // 29 rows in 2: the lower tile has floor(29 / 2) = 14 rows, so the upper one has rows 0..14 from the top.
    std::vector<float> truth(2 * 29, 1.0f), result(2 * 29, 1.0f);
    for (std::size_t i = 2 * 15; i < result.size(); ++i) result[i] = 0.0f;
    const std::vector<std::uint8_t> judged(2 * 29, 1);
    EXPECT_EQ(seamJump({2, 29, truth, result, judged}, 1, 2).jumps, 2u);
}

TEST(SurfaceChange, ComparesMatchedPixels) {
    const std::vector<float> first{1, 0, 1, 0}, second{0, 0, 1, 0.25f};
    const std::vector<std::uint8_t> judged{1, 1, 1, 1}, half{1, 1, 0, 1};
    const std::vector<std::uint32_t> same{0, 1, 2, 3}, moved{1, 2, kUnmatched, kUnmatched};
    EXPECT_DOUBLE_EQ(surfaceChange(first, second, same, judged, judged).mean, 1.25 / 4.0);
    EXPECT_DOUBLE_EQ(surfaceChange(first, second, same, judged, judged).changed, 0.25);
    EXPECT_DOUBLE_EQ(surfaceChange(first, second, moved, judged, judged).mean, 1.0);
    EXPECT_EQ(surfaceChange(first, second, moved, judged, judged).pairs, 2u);
    EXPECT_EQ(surfaceChange(first, second, moved, judged, half).pairs, 1u);
    EXPECT_EQ(surfaceChange(first, first, same, judged, judged).mean, 0.0);
}

TEST(SurfaceRivalry, IsToDifferFromAllPixelsAround) {
    constexpr std::uint32_t kNone = kUnmatched;
    using Around = std::vector<std::array<std::uint32_t, 4>>;
    const std::vector<float> first = {0, 0, 1, 1, 0}, second = {1, 1, 0, 1, 1};
    std::vector<std::uint8_t> judged(5, 1);
    // Alone among two; beside one of its kind; alone against one; alike; hidden.
    const Around around = {
        {0, 1, kNone, kNone}, {1, 2, 0, kNone}, {2, kNone, kNone, kNone}, {3, 2, 1, 0}, {kNone, kNone, kNone, kNone}};
    SurfaceRivalry rivalry = surfaceRivalry(first, second, around, judged, judged);
    EXPECT_EQ(rivalry.points, 4u);
    EXPECT_EQ(rivalry.rivals, 2u);
    EXPECT_EQ(rivalry.share(), 0.5);
    judged[2] = 0;  // in both pictures: takes the second, third and fourth out
    rivalry = surfaceRivalry(first, second, around, judged, judged);
    EXPECT_EQ(rivalry.points, 1u);
    EXPECT_EQ(rivalry.rivals, 1u);
    EXPECT_EQ(surfaceRivalry({}, {}, {}, {}, {}).share(), 0.0);
}

TEST(ShadowPerception, EqualFactorsShowNoDifference) {
    const auto truth = litFrom(20, 6.0);
    EXPECT_EQ(shadowDeltaE(factorsOf(truth, truth)).max, 0.0);
    EXPECT_EQ(shadowMachBands(factorsOf(truth, truth)).response.max, 0.0);
    const std::vector<float> lit(kPixels, 1.0f), dark(kPixels, 0.0f);
    EXPECT_NEAR(shadowDeltaE(factorsOf(lit, dark)).mean, 100.0, 1e-4);  // L* of white
    EXPECT_NEAR(shadowMachBands(factorsOf(lit, dark)).response.mean, 0.6, 1e-5);
}

// Swapping truth and result swaps leaks and acne.
RC_GTEST_PROP(ShadowError, IsAntisymmetric, ()) {
    const auto truth = *rc::gen::container<std::vector<std::uint8_t>>(kPixels, rc::gen::inRange<std::uint8_t>(0, 5));
    const auto result = *rc::gen::container<std::vector<std::uint8_t>>(kPixels, rc::gen::inRange<std::uint8_t>(0, 5));
    std::vector<float> a, b;
    for (std::size_t i = 0; i < kPixels; ++i) {
        a.push_back(0.25f * static_cast<float>(truth[i]));
        b.push_back(0.25f * static_cast<float>(result[i]));
    }
    const ShadowError one = shadowError(factorsOf(a, b)), other = shadowError(factorsOf(b, a));
    RC_ASSERT(one.leak == other.acne && one.acne == other.leak && one.rmse == other.rmse);
    RC_ASSERT(one.wrongSide == other.wrongSide);
    RC_ASSERT(one.rmse * one.rmse <= one.error() + 1e-12 && one.error() <= one.rmse + 1e-12);
}

}  // namespace
}  // namespace umbriel
