#include "common/image/picture_measures.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "common/image/colour_difference.h"
#include "common/image/display.h"
#include "common/image/grey.h"
#include "tests/unit/image/test_files.h"

namespace umbriel {
namespace {

FloatImage grey(int width, int height, float value) {
    return FloatImage(width, height, {"Y"}, value);
}

FloatImage flat(int width, int height, float value) {
    return FloatImage(width, height, {"R", "G", "B", "A"}, value);
}

// White from column `edge` on.
FloatImage step(int width, int height, int edge) {
    FloatImage picture = makeRgbaImage(width, height);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            for (int c = 0; c < 4; ++c) {
                picture.at(x, y, c) = x >= edge || c == 3 ? 1.0F : 0.0F;
            }
        }
    }
    return picture;
}

TEST(Spread, IsOfNearestRank) {
    std::vector<float> values;
    for (int i = 100; i > 0; --i) {
        values.push_back(static_cast<float>(i));
    }
    const Spread spread = spreadOf(values);
    EXPECT_EQ(spread.mean, 50.5);
    EXPECT_EQ(spread.median, 50.0);
    EXPECT_EQ(spread.percentile95, 95.0);
    EXPECT_EQ(spread.max, 100.0);
    EXPECT_EQ(spreadOf({7.0F}).percentile95, 7.0);
    EXPECT_EQ(spreadOf({}).max, 0.0);
}

TEST(MachBands, TextbookRow) {
    const std::vector<float> row{10, 10, 10, 30, 30, 30};
    const std::vector<float> expected{8, 8, 6, 26, 24, 24};
    EXPECT_EQ(retinaRow(row), expected);
    EXPECT_EQ(retinaRow(std::vector<float>{5.0F}), std::vector<float>{4.0F});
    EXPECT_TRUE(retinaRow({}).empty());
}

// A picture that changes along one axis shows the row's bands, minus 0.2 of its value, whichever the axis.
TEST(MachBands, PictureExtendsTheRow) {
    const float row[] = {10, 10, 10, 30, 30, 30};
    const float rowResponse[] = {8, 8, 6, 26, 24, 24};
    FloatImage across = grey(6, 4, 0.0F);
    FloatImage down = grey(4, 6, 0.0F);
    for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < 4; ++j) {
            across.at(i, j, 0) = row[i];
            down.at(j, i, 0) = row[i];
        }
    }
    for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < 4; ++j) {
            EXPECT_NEAR(retinaImage(across).at(i, j, 0), rowResponse[i] - 0.2F * row[i], 1e-5F);
            EXPECT_NEAR(retinaImage(down).at(j, i, 0), rowResponse[i] - 0.2F * row[i], 1e-5F);
        }
    }
}

// A ramp has no band inside; its kinks have, though the greys differ from the smooth curve by little.
TEST(MachBands, KinksShowWhereGreysHardlyDiffer) {
    FloatImage smooth = grey(65, 3, 0.0F);
    FloatImage kinked = grey(65, 3, 0.0F);
    for (int x = 0; x < 65; ++x) {
        const float t = static_cast<float>(x) / 64.0F;
        for (int y = 0; y < 3; ++y) {
            smooth.at(x, y, 0) = 0.5F * t * t;
            // Interpolated linearly between every 16th value.
            const int cell = std::min(x / 16, 3);
            const float a = static_cast<float>(cell) / 4.0F;
            const float b = a + 0.25F;
            kinked.at(x, y, 0) = 0.5F * (a * a + (b * b - a * a) * (t - a) / 0.25F);
        }
    }
    const MachBandDifference difference = machBandDifference(smooth, kinked);
    // Slopes jump by 0.5 * (b + c) - 0.5 * (a + b) = 0.25 per unit, 0.25 / 64 a pixel, of which 10 % show; between the
    // kinks the smooth curve's own second difference, 1 / 64^2, is missing.
    EXPECT_NEAR(difference.overshoot.max, 0.1 * (0.25 / 64.0 - 1.0 / 4096.0), 1e-6);
    EXPECT_NEAR(difference.overshoot.median, 0.1 / 4096.0, 1e-6);
    EXPECT_EQ(machBandDifference(smooth, smooth).response.max, 0.0);
    // A constant offset is no band.
    FloatImage lifted = smooth;
    for (float& sample : lifted.samples()) {
        sample += 0.125F;
    }
    EXPECT_NEAR(machBandDifference(smooth, lifted).response.mean, 0.6 * 0.125, 1e-6);
    EXPECT_LT(machBandDifference(smooth, lifted).overshoot.max, 1e-6);
}

// Values of Lab: white and black by definition; the primaries as Lindbloom's calculator gives them for sRGB, D65.
TEST(ColourDifference, LabOfKnownColours) {
    const auto expectLab = [](const std::array<double, 3>& lab, double l, double a, double b, double tolerance) {
        EXPECT_NEAR(lab[0], l, tolerance);
        EXPECT_NEAR(lab[1], a, tolerance);
        EXPECT_NEAR(lab[2], b, tolerance);
    };
    expectLab(labFromLinear(0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 1e-12);
    expectLab(labFromLinear(1.0, 1.0, 1.0), 100.0, 0.0, 0.0, 1e-12);
    expectLab(labFromLinear(0.18418651851244416, 0.18418651851244416, 0.18418651851244416), 50.0, 0.0, 0.0, 1e-9);
    expectLab(labFromLinear(1.0, 0.0, 0.0), 53.24, 80.09, 67.20, 0.05);
    expectLab(labFromLinear(0.0, 1.0, 0.0), 87.73, -86.18, 83.18, 0.05);
    expectLab(labFromLinear(0.0, 0.0, 1.0), 32.30, 79.19, -107.86, 0.05);
    // Both branches meet at (6 / 29)^3: L* = 8.
    const double bend = std::pow(6.0 / 29.0, 3.0);
    EXPECT_NEAR(labFromLinear(bend, bend, bend)[0], 8.0, 1e-9);
    EXPECT_NEAR(labFromLinear(bend * (1 + 1e-9), bend, bend)[0], 8.0, 1e-6);
}

TEST(ColourDifference, IsOfWhatTheDisplayShows) {
    EXPECT_NEAR(colourDifference(flat(3, 2, 0.0F), flat(3, 2, 1.0F), 1.0).mean, 100.0, 1e-4);
    EXPECT_EQ(colourDifference(flat(3, 2, 1.0F), flat(3, 2, 5.0F), 1.0).max, 0.0);     // both white
    EXPECT_GT(colourDifference(flat(3, 2, 1.0F), flat(3, 2, 5.0F), 0.125).max, 20.0);  // three stops down
    FloatImage one = flat(10, 10, 0.25F);
    one.at(3, 3, 0) = std::nanf("");
    const Spread spread = colourDifference(one, flat(10, 10, 0.25F), 1.0);
    EXPECT_EQ(spread.percentile95, 0.0);
    EXPECT_GT(spread.max, 10.0);
}

TEST(EdgeDisplacement, OfAShiftedEdgeIsTheShift) {
    for (const int shift : {0, 1, 3, 17}) {
        const EdgeDisplacement d =
            edgeDisplacement(displayGrey(step(64, 20, 20), 1.0), displayGrey(step(64, 20, 20 + shift), 1.0));
        EXPECT_EQ(d.edgesA, 20U);  // one pixel wide
        EXPECT_EQ(d.edgesB, 20U);
        for (const Spread& spread : {d.fromA, d.fromB}) {
            EXPECT_EQ(spread.median, shift);
            EXPECT_EQ(spread.percentile95, shift);
        }
    }
}

TEST(EdgeDisplacement, SeesAnEdgeThatIsMissingInOneDirectionOnly) {
    FloatImage two = step(64, 20, 20);
    for (int y = 0; y < 20; ++y) {
        for (int x = 50; x < 64; ++x) {
            two.at(x, y, 0) = two.at(x, y, 1) = two.at(x, y, 2) = 0.0F;
        }
    }
    const EdgeDisplacement d = edgeDisplacement(displayGrey(two, 1.0), displayGrey(step(64, 20, 20), 1.0));
    EXPECT_EQ(d.edgesA, 40U);
    EXPECT_EQ(d.fromA.median, 0.0);
    EXPECT_EQ(d.fromA.percentile95, 31.0);  // the falling edge's dark side is column 50, the rising one's 19
    EXPECT_EQ(d.fromB.max, 0.0);
    const EdgeDisplacement none = edgeDisplacement(displayGrey(two, 1.0), displayGrey(flat(64, 20, 0.5F), 1.0));
    EXPECT_EQ(none.edgesB, 0U);
    EXPECT_TRUE(std::isinf(none.fromA.median));
    EXPECT_EQ(none.fromB.max, 0.0);
}

TEST(EdgeDisplacement, ThresholdIsHalfTheStep) {
    FloatImage picture = grey(16, 8, 0.25F);
    for (int y = 0; y < 8; ++y) {
        for (int x = 8; x < 16; ++x) {
            picture.at(x, y, 0) = 0.375F;
        }
    }
    const auto count = [&](float threshold) {
        const auto edges = edgePixels(picture, {threshold});
        return std::count(edges.begin(), edges.end(), 1);
    };
    EXPECT_EQ(count(0.0625F), 8);
    EXPECT_EQ(count(0.0626F), 0);
}

RC_GTEST_PROP(EdgeDisplacement, DistancesAreThoseOfTheExhaustiveSearch, ()) {
    const int width = *rc::gen::inRange(1, 24);
    const int height = *rc::gen::inRange(1, 24);
    std::mt19937_64 random(*rc::gen::arbitrary<std::uint64_t>());
    const std::uint64_t rarity = 1 + random() % 60;
    std::vector<std::uint8_t> marked(static_cast<std::size_t>(width * height));
    for (std::uint8_t& mark : marked) {
        mark = random() % rarity == 0 ? 1 : 0;
    }
    const std::vector<float> distances = squaredDistances(marked, width, height);
    for (int i = 0; i < width * height; ++i) {
        float nearest = std::numeric_limits<float>::infinity();
        for (int j = 0; j < width * height; ++j) {
            const int dx = i % width - j % width;
            const int dy = i / width - j / width;
            if (marked[static_cast<std::size_t>(j)] != 0) {
                nearest = std::min(nearest, static_cast<float>(dx * dx + dy * dy));
            }
        }
        RC_ASSERT(distances[static_cast<std::size_t>(i)] == nearest);
    }
}

TEST(PictureMeasures, ThresholdCountsWhatIsMoreAndWhatIsNotFinite) {
    const FloatImage a = flat(4, 1, 0.5F);
    FloatImage b = a;
    b.at(0, 0, 1) = 0.75F;
    b.at(1, 0, 2) = 0.5F + 0.375F;
    b.at(2, 0, 0) = std::numeric_limits<float>::infinity();
    b.at(3, 0, 3) = 0.0F;  // alpha has its own counts
    EXPECT_EQ(measurePictures(a, b, {.threshold = 0.25}).aboveThreshold, 2U);
    EXPECT_EQ(measurePictures(a, b, {.threshold = 0.24}).aboveThreshold, 3U);
    EXPECT_EQ(measurePictures(b, b, {.threshold = 0.25}).aboveThreshold, 1U);  // infinite in both
}

// Whatever the bits: finite but for edges that one side lacks, and the same for the swapped pair.
RC_GTEST_PROP(PictureMeasures, AreSymmetricAndFinite, ()) {
    const int width = *rc::gen::inRange(1, 12);
    const int height = *rc::gen::inRange(1, 12);
    std::mt19937_64 random(*rc::gen::arbitrary<std::uint64_t>());
    FloatImage a = makeRgbaImage(width, height);
    FloatImage b = makeRgbaImage(width, height);
    test::fillWithAnyBits(a, random);
    test::fillWithAnyBits(b, random);
    const PictureMeasures ab = measurePictures(a, b);
    const PictureMeasures ba = measurePictures(b, a);
    RC_ASSERT(ab.aboveThreshold == ba.aboveThreshold);
    RC_ASSERT(ab.deltaE.mean == ba.deltaE.mean && ab.machBands.response.mean == ba.machBands.response.mean);
    RC_ASSERT(ab.edges.fromA.median == ba.edges.fromB.median && ab.edges.edgesA == ba.edges.edgesB);
    RC_ASSERT(std::isfinite(ab.deltaE.max) && std::isfinite(ab.machBands.response.max));
    RC_ASSERT(std::isfinite(ab.edges.fromA.max) || ab.edges.edgesB == 0);
}

}  // namespace
}  // namespace umbriel
