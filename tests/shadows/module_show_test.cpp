#include "common/wall/shadow_show.h"
#include "tests/shadows/shadow_fixture.h"

namespace umbriel {
namespace {

class Show : public ModuleTest {
 protected:
    std::size_t shadedPixels = 0;
    // Of the surfaces that face the light, the share that the picture has in shadow.
    double darkShare(PixelSize wall) {
        const WallViews views = resolved(wall);
        const auto images = drawWall(views);
        std::size_t dark = 0;
        shadedPixels = 0;
        for (const View& view : views.views)
            for (int y = view.region.y; y < view.region.y + view.region.height; ++y)
                for (int x = view.region.x; x < view.region.x + view.region.width; ++x) {
                    const float* p = images[1].at(x, y);
                    const float* n = images[2].at(x, y);
                    const glm::dvec3 normal(n[0], n[1], n[2]);
                    if (glm::dot(normal, normal) < 0.5) continue;
                    const glm::dvec3 toLight =
                        lightPlace == LightPlace::Directional
                            ? -lightDirection
                            : glm::normalize(lightPosition - view.eyeWorld - glm::dvec3(p[0], p[1], p[2]));
                    if (glm::dot(normal, toLight) < 0.1) continue;
                    ++shadedPixels;
                    dark += images[3].at(x, y)[0] < 0.5f;
                }
        return static_cast<double>(dark) / static_cast<double>(std::max<std::size_t>(shadedPixels, 1));
    }
};

// From the light no shadow can be seen: what it sees, it lights. In warped maps, too, and whatever the light.
TEST_F(Show, TheLightSeesNoShadow) {
    struct Case {
        LightPlace place;
        ShadowMode mode;
        std::size_t views;
    };
    for (const Case& each :
         {Case{LightPlace::Directional, ShadowMode::Standard, 1},
          Case{LightPlace::Directional, ShadowMode::LightSpacePerspective, 1},
          Case{LightPlace::Directional, ShadowMode::Perspective, 1},
          Case{LightPlace::Directional, ShadowMode::VolumeZFail, 1}, Case{LightPlace::Spot, ShadowMode::Trapezoid, 1},
          Case{LightPlace::Point, ShadowMode::Cube, 6}, Case{LightPlace::Point, ShadowMode::DualParaboloid, 6}}) {
        SetUp();
        buildTown(30.0, 60);
        finishScene(each.place, {3, 12, 2}, {0.5, -0.7, -0.3});
        look({0, 4, 28}, {0, 1, 0});
        scene->edit(viewport).set<&Viewport::shadowMode>(each.mode).set<&Viewport::mapSize>(2048u);
        const PixelSize wall{480, 320};
        const double inView = darkShare(wall);
        scene->edit(viewport).set<&Viewport::show>(ShadowShow::LightView);
        EXPECT_EQ(resolved(wall).views.size(), each.views);
        const double fromLight = darkShare(wall);
        std::printf("mode %d: %.1f %% of the picture is dark, %.3f %% of what the light sees (%zu pixels)\n",
                    static_cast<int>(each.mode), 100 * inView, 100 * fromLight, shadedPixels);
        EXPECT_GT(inView, 0.005);
        EXPECT_GT(shadedPixels, 10000u);
        // Pixels on the outlines, where a map's texel is another's.
        EXPECT_LT(fromLight, 0.002);
    }
}

TEST_F(Show, TilesAreBitEqualToOneServer) {
    buildTown(30.0, 60);
    finishScene(LightPlace::Point, {2, 6, 8}, {0, -1, 0});
    look({0, 4, 28}, {0, 1, 0});
    scene->edit(viewport).set<&Viewport::mapSize>(256u).set<&Viewport::gauss>(4.0f);
    const PixelSize wall{341, 227};
    for (const ShadowMode mode : {ShadowMode::PercentageCloser, ShadowMode::DualParaboloid})
        for (std::uint32_t i = 1; i < kEnumCount<ShadowShow>; ++i)
            for (const TileMode tiles : {TileMode::Exact, TileMode::Offset}) {
                scene->edit(viewport).set<&Viewport::shadowMode>(mode).set<&Viewport::show>(static_cast<ShadowShow>(i));
                WallViews views = resolved(wall, tiles);
                views.layers = static_cast<std::uint32_t>(Layer::Colour);
                const auto whole = drawWall(views);
                ASSERT_EQ(whole.size(), 1u);
                float most = 0.0f;
                for (const float value : whole[0].values) most = std::max(most, value);
                EXPECT_GT(most, 0.2f) << "something is shown, " << i;
                const int side = tiles == TileMode::Exact ? 4 : 2;
                EXPECT_EQ(differingPixels(whole[0], drawWall(views, side, side)[0]), 0u)
                    << "show " << i << ", mode " << static_cast<int>(mode) << ", " << side << "x" << side;
            }
}

TEST_F(Show, WhatCannotBeShownIsSaid) {
    buildTown(30.0, 5);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    look({0, 4, 28}, {0, 1, 0});
    scene->edit(viewport)
        .set<&Viewport::shadowMode>(ShadowMode::VolumeZFail)
        .set<&Viewport::show>(ShadowShow::ShadowMap);
    resolved({64, 48});
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("has no map"), std::string::npos) << warnings[0];
    scene->edit(viewport).set<&Viewport::shadowMode>(ShadowMode::None).set<&Viewport::show>(ShadowShow::FactorMap);
    resolved({64, 48});
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("--shadow"), std::string::npos) << warnings[0];
    scene->edit(viewport).set<&Viewport::show>(ShadowShow::EdgeMap);
    resolved({64, 48});
    EXPECT_TRUE(warnings.empty());
}

}  // namespace
}  // namespace umbriel
