// What colours are drawn into: 32, 16 or 8 bits a channel (ColourPrecision).

#include <array>

#include "common/math/half.h"
#include "tests/golden/draw_fixture.h"

namespace umbriel {
namespace {

constexpr PixelSize kWall{64, 48};
constexpr PixelRect kWhole{0, 0, kWall.width, kWall.height};

class PrecisionTest : public DrawTest {
 protected:
    void SetUp() override {
        DrawTest::SetUp();
        scene->edit(viewport).set<&Viewport::shadowMode>(ShadowMode::None);
    }
    WallViews in(ColourPrecision precision, std::uint32_t samples = 1,
                 std::uint32_t layers = static_cast<std::uint32_t>(Layer::Colour)) const {
        WallViews views = wallViews(flatView(8.0, kWall), TileMode::Exact, samples, layers);
        views.colourPrecision = precision;
        return views;
    }
    std::vector<TileLayer> layersOf(const WallViews& views) {
        sync();
        const TileAssignment all{0, kWhole, Eye::Mono};
        auto drawn = renderer->draw(*scene, views, {&all, 1}, 0.0);
        EXPECT_TRUE(drawn) << drawn.error().message;
        auto read = renderer->readTiles();
        EXPECT_TRUE(read) << read.error().message;
        return read ? read->front().layers : std::vector<TileLayer>();
    }
    void gradient(glm::vec4 bottom, glm::vec4 top) {
        const auto made = scene->create<GradientBackground>();
        scene->edit(made).set<&GradientBackground::bottom>(bottom).set<&GradientBackground::top>(top);
        scene->edit(viewport).set<&Viewport::background>(Ref<Container>(made.id));
    }
    // Before what was there, across all of the view.
    void pane(glm::vec4 colour, double z) {
        const auto made = material(colour, ReflectionModel::Unlit);
        scene->edit(made).set<&Material::alphaMode>(AlphaMode::Blend);
        node(placed(root, {0, 0, z}), geometry(gridMesh(5.0f), made));
    }
};

TEST_F(PrecisionTest, WhatIsSentHasThePrecisionThatWasAskedFor) {
    gradient({0.1f, 0.2f, 0.3f, 1}, {1, 0.5f, 0, 1});
    const auto colour = [&](ColourPrecision precision) { return layersOf(in(precision)).front(); };
    const std::size_t values = std::size_t{4} * kWall.width * kWall.height;
    const TileLayer whole = colour(ColourPrecision::Float);
    EXPECT_EQ(whole.components, ComponentType::Float);
    EXPECT_EQ(whole.pixels.size(), 4 * values);
    const TileLayer half = colour(ColourPrecision::Half);
    EXPECT_EQ(half.components, ComponentType::Half);
    EXPECT_EQ(half.pixels.size(), 2 * values);
    const TileLayer byte = colour(ColourPrecision::Byte);
    EXPECT_EQ(byte.components, ComponentType::Byte);
    EXPECT_EQ(byte.pixels.size(), values);
    EXPECT_EQ(colour(ColourPrecision::Float).pixels, whole.pixels) << "other images were made meanwhile";
}

// One rounding, whichever way the driver rounds: less than a step.
TEST_F(PrecisionTest, AnOpaquePixelIsTheFloatRoundedOnce) {
    gradient({1e-7f, 0.003f, 0.02f, 1}, {1e-4f, 1.0f, 30.0f, 1});
    const WallImage whole = drawColour(in(ColourPrecision::Float));
    const WallImage half = drawColour(in(ColourPrecision::Half));
    const WallImage byte = drawColour(in(ColourPrecision::Byte));
    for (std::size_t i = 0; i < whole.values.size(); ++i) {
        const float exact = whole.values[i];
        const float step = std::max(std::exp2(std::floor(std::log2(exact)) - 10.0f), 0x1p-24f);
        ASSERT_LT(std::abs(half.values[i] - exact), step) << i << ": " << exact;
        ASSERT_LE(std::abs(encoded(half.values[i]) - encoded(exact)), 1) << exact;
        ASSERT_LT(std::abs(byte.values[i] - std::min(exact, 1.0f)), 1.0f / 255.0f) << exact;
    }
}

// Of a level of 8 bits, half floats are off by no more than a ninth, and by less in darks: their steps shrink with the
// value, those of sRGB do not.
TEST_F(PrecisionTest, AHalfIsOffByAtMostANinthOfALevelAtAnyBrightness) {
    const auto level = [](double linear) {
        return 255.0 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055);
    };
    double most = 0.0, mostInDarks = 0.0;
    for (std::uint32_t bits = 0; bits < 0x3c00u; ++bits) {  // up to 1
        const double gap = level(floatFromHalf(static_cast<std::uint16_t>(bits + 1))) -
                           level(floatFromHalf(static_cast<std::uint16_t>(bits)));
        most = std::max(most, gap);
        if (bits < 0x1c00u) mostInDarks = std::max(mostInDarks, gap);  // up to 2^-8
    }
    EXPECT_LT(most, 1.0 / 9.0);
    EXPECT_LT(mostInDarks, 1.0 / 60.0);
}

// A far too bright surface behind what covers it: infinity times 0 would be no number.
TEST_F(PrecisionTest, WhatIsBeyondThePrecisionLeavesNoHoles) {
    for (const std::uint32_t samples : {1u, 4u})
        for (const ColourPrecision precision : {ColourPrecision::Half, ColourPrecision::Byte}) {
            SetUp();
            SCOPED_TRACE(static_cast<int>(precision));
            gradient({1e9f, 7e4f, 1e30f, 1}, {1e9f, 7e4f, 1e30f, 1});
            const WallImage behind = drawColour(in(precision, samples));
            pane({0.25f, 0.5f, 0.75f, 1.0f}, 0);
            const WallImage covered = drawColour(in(precision, samples));
            pane({1e20f, 1e9f, 6e4f, 0.5f}, 1);
            pane({1e20f, 1e9f, 6e4f, 0.5f}, 2);
            const WallImage added = drawColour(in(precision, samples));
            pane({0.25f, 0.5f, 0.75f, 1.0f}, 3);
            const WallImage coveredAgain = drawColour(in(precision, samples));
            for (std::size_t i = 0; i < behind.values.size(); ++i) {
                const float pane = std::array{0.25f, 0.5f, 0.75f, 1.0f}[i % 4];
                ASSERT_GE(behind.values[i], 1.0f);
                ASSERT_NEAR(covered.values[i], pane, 1.0f / 255.0f);
                ASSERT_GE(added.values[i], 1.0f);
                ASSERT_NEAR(coveredAgain.values[i], pane, 1.0f / 255.0f);
            }
        }
}

// What is measured with must not follow what is looked at.
TEST_F(PrecisionTest, OtherLayersHaveTheSameBitsInEveryPrecision) {
    const auto sun = scene->create<DirectionalLight>("sun");
    const Ref<Node> all = lit(root, sun, {-0.3f, -0.4f, -1.0f});
    node(placed(all, {0, 0, 1}), geometry(boxMesh({0.7f, 0.9f, 0.4f}), material({0.3f, 0.6f, 0.9f, 1})));
    for (const std::uint32_t samples : {1u, 4u}) {
        const auto whole = layersOf(in(ColourPrecision::Float, samples, 0x3f));
        ASSERT_EQ(whole.size(), 6u);
        for (const ColourPrecision precision : {ColourPrecision::Half, ColourPrecision::Byte}) {
            const auto other = layersOf(in(precision, samples, 0x3f));
            ASSERT_EQ(other.size(), 6u);
            EXPECT_NE(other[0].pixels.size(), whole[0].pixels.size());
            for (std::size_t i = 1; i < 6; ++i) {
                EXPECT_EQ(other[i].components, whole[i].components);
                EXPECT_EQ(other[i].pixels, whole[i].pixels) << whole[i].name;
            }
        }
    }
}

}  // namespace
}  // namespace umbriel
