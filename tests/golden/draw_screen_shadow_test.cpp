#include <numeric>

#include "common/wall/screen_shadow.h"
#include "tests/golden/draw_fixture.h"

namespace umbriel {
namespace {

constexpr std::uint32_t kFactors =
    static_cast<std::uint32_t>(Layer::Colour) | static_cast<std::uint32_t>(Layer::LightFactors);

// Shadow factors in a map of pixels: the filter over it, and what reads it. A plate of 1 m at 1 m height above a floor,
// seen from above at 1 cm a pixel, in light that falls at 45 degrees: its shadow is as large and 1 m to the right.
class ScreenShadowTest : public DrawTest {
 protected:
    void SetUp() override {
        DrawTest::SetUp();
        if (HasFatalFailure()) return;
        light = scene->create<DirectionalLight>("sun");
        below = lit(root, light, kTravels);
        floor = material({0.5f, 0.25f, 1.0f, 1.0f}, ReflectionModel::Lambert);
        node(below, geometry(gridMesh(8.0f, 8), floor));
        node(placed(below, {-2, 0, 1}), geometry(gridMesh(0.5f), floor));
    }
    View look() const {
        View view = flatView(4.0, {400, 300});
        ShadowFit fit;
        fit.light = light.id;
        fit.mode = ShadowMode::VolumeZFail;  // edges that no texel moves
        fit.worldFromLight = glm::dmat3(lookingAlong(kTravels));
        view.fits = {fit};
        return view;
    }

    static constexpr glm::vec3 kTravels{1, 0, -1};
    Ref<DirectionalLight> light;
    Ref<Node> below;
    Ref<Material> floor;
};

TEST_F(ScreenShadowTest, AnEdgeBecomesTheSumOfTheWeights) {
    for (const std::uint32_t samples : {1u, 4u})
        for (const float radius : {1.0f, 3.0f, 5.5f, 12.0f}) {
            scene->edit(viewport).set<&Viewport::gauss>(radius);
            const auto images = drawWall(wallViews(look(), TileMode::Exact, samples, kFactors));
            ASSERT_EQ(images.size(), 2u);
            const std::vector<float> weights = gaussWeights(radius);
            const int reach = static_cast<int>(weights.size()) - 1;
            // The shadow's right edge stands between the pixels 149 and 150 of a row through its middle.
            for (int x = 120; x < 180; ++x) {
                double lit = 0.0;
                for (int i = -reach; i <= reach; ++i)
                    if (x + i >= 150) lit += static_cast<double>(weights[static_cast<std::size_t>(std::abs(i))]);
                // Sums of at most 50 rounded numbers.
                EXPECT_NEAR(images[1].at(x, 150)[0], lit, 1e-5) << "x " << x << ", radius " << radius;
            }
        }
}

TEST_F(ScreenShadowTest, TheFactorMultipliesTheLightsOwnTermWithTheShadowsColour) {
    const glm::vec3 tint(0.2f, 0.4f, 0.1f);
    scene->edit(viewport).set<&Viewport::gauss>(8.0f).set<&Viewport::shadowColor>(tint);
    scene->edit(floor).set<&Material::emission>(glm::vec3(0.05f));
    const auto images = drawWall(wallViews(look(), TileMode::Exact, 1, kFactors));
    ASSERT_EQ(images.size(), 2u);
    const glm::vec3 colour(0.5f, 0.25f, 1.0f);
    std::size_t between = 0;
    for (int y = 0; y < 300; ++y)
        for (int x = 80; x < 400; ++x) {
            const float factor = images[1].at(x, y)[0];
            between += factor > 0.05f && factor < 0.95f;
            for (int channel = 0; channel < 3; ++channel) {
                const float term = colour[channel] * 0.31830989f * 0.70710678f;
                ASSERT_NEAR(images[0].at(x, y)[channel], 0.05f + term * (factor + (1 - factor) * tint[channel]), 1e-5)
                    << x << ", " << y;
            }
        }
    EXPECT_GT(between, 1000u);
}

// Unlit surfaces have light in their colours: what shadows leave of all of it, ambient light with it, is what they
// keep.
TEST_F(ScreenShadowTest, ForeignShadingIsDarkenedByTheShareOfAllLight) {
    const glm::vec3 colour(0.5f, 0.25f, 1.0f);
    scene->edit(floor).set<&Material::model>(ReflectionModel::Unlit);
    const auto ambient = scene->create<AmbientLight>();
    scene->edit(ambient).set<&AmbientLight::radiance>(glm::vec3(0.1f));
    const auto children = scene->find(root)->children.toVector();
    const Ref<Node> all = scene->create<Node>();
    scene->edit(all).set<&Node::core>(Ref<Container>(ambient.id)).assign<&Node::children>(children);
    scene->edit(root).assign<&Node::children>(std::vector{all});
    const auto plain = drawWall(wallViews(look(), TileMode::Exact, 1, kFactors));
    ASSERT_EQ(plain.size(), 2u);
    EXPECT_EQ(plain[0].at(100, 150)[2], colour.z) << "unlit is unlit";
    scene->edit(viewport).set<&Viewport::foreignShading>(true);
    const auto images = drawWall(wallViews(look(), TileMode::Exact, 1, kFactors));
    ASSERT_EQ(images.size(), 2u);
    const double direct = std::sqrt(0.5), around = 0.1 * 3.14159265358979;
    const double left = around / (around + direct);
    for (int channel = 0; channel < 3; ++channel) {
        EXPECT_NEAR(images[0].at(100, 150)[channel], left * static_cast<double>(colour[channel]), 1e-5);
        EXPECT_NEAR(images[0].at(300, 150)[channel], colour[channel], 1e-6);
    }
}

TEST_F(ScreenShadowTest, WhatIsOffCostsNothing) {
    scene->edit(viewport).set<&Viewport::edgeThreshold>(0.02f);
    drawWall(wallViews(look()));
    const std::string off = renderer->explain();
    for (const char* word : {"factors", "edges", "gauss", "normals: ", "positions"})
        EXPECT_EQ(off.find(word), std::string::npos) << word << " in " << off;
    scene->edit(viewport).set<&Viewport::gauss>(4.0f);
    drawWall(wallViews(look()));
    const std::string on = renderer->explain();
    EXPECT_NE(on.find("gauss       reach 4 px"), std::string::npos) << on;
    EXPECT_NE(on.find("edges       reach 1 px"), std::string::npos) << on;
    scene->edit(viewport).set<&Viewport::edgeThreshold>(0.0f);
    drawWall(wallViews(look()));
    EXPECT_EQ(renderer->explain().find("edges   "), std::string::npos) << renderer->explain();
    scene->edit(viewport).set<&Viewport::gauss>(0.0f).set<&Viewport::edgeThreshold>(0.02f);
    drawWall(wallViews(look()));
    EXPECT_EQ(renderer->explain(), off);
    // Nor where nothing casts a shadow.
    scene->edit(viewport).set<&Viewport::gauss>(4.0f).set<&Viewport::shadowOn>(false);
    drawWall(wallViews(look()));
    EXPECT_EQ(renderer->explain().find("gauss"), std::string::npos);
}

}  // namespace
}  // namespace umbriel
