#include <cmath>

#include "common/wall/screen_shadow.h"
#include "tests/shadows/shadow_fixture.h"

namespace umbriel {
namespace {

// The screen-space path: factors in a map of pixels, filtered there.
class ScreenSpace : public ModuleTest {
 protected:
    // A lamp beside the sun: two layers, one of a cube.
    void addLamp() {
        const auto lamp = scene->create<PointLight>("lamp");
        scene->edit(lamp)
            .set<&PointLight::beacon>(placed(root, toWorld({2, 6, 8})))
            .set<&PointLight::intensity>(glm::vec3(30.0f));
        const auto children = scene->find(root)->children.toVector();
        const Ref<Node> lampNode = scene->create<Node>();
        scene->edit(lampNode).set<&Node::core>(Ref<Container>(lamp.id)).assign<&Node::children>(children);
        scene->edit(root).assign<&Node::children>(std::vector{lampNode});
    }
};

constexpr ShadowMode kModes[] = {ShadowMode::Standard,
                                 ShadowMode::LightSpacePerspective,
                                 ShadowMode::PercentageCloser,
                                 ShadowMode::PercentageCloserSoft,
                                 ShadowMode::DualParaboloid,
                                 ShadowMode::VolumeZFail,
                                 ShadowMode::Blob};

// Without a filter the way through pixels changes nothing: to the bit where factors are 0 or 1, else as 1 - (1 - f)
// rounds.
TEST_F(ScreenSpace, WithoutAFilterThePictureIsThatOfTheDirectPath) {
    buildTown(30.0, 60);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3}, 0.0f, 0.02f);
    addLamp();
    look({0, 4, 28}, {0, 1, 0});
    const PixelSize wall{341, 227};
    for (const ShadowMode mode : {ShadowMode::Standard, ShadowMode::Cube, ShadowMode::PercentageCloserSoft}) {
        scene->edit(viewport).set<&Viewport::shadowMode>(mode).set<&Viewport::screenSpace>(false);
        const auto direct = drawWall(resolved(wall));
        scene->edit(viewport).set<&Viewport::screenSpace>(true);
        const auto screen = drawWall(resolved(wall));
        ASSERT_EQ(direct.size(), screen.size());
        const bool isHard = mode != ShadowMode::PercentageCloserSoft;
        for (std::size_t i = 0; i < direct.size(); ++i) {
            float largest = 0.0f;
            for (std::size_t k = 0; k < direct[i].values.size(); ++k)
                largest = std::max(largest, std::abs(direct[i].values[k] - screen[i].values[k]));
            EXPECT_LE(largest, isHard ? 0.0f : 2e-7f * 8) << names[i] << ", mode " << static_cast<int>(mode);
        }
    }
}

TEST_F(ScreenSpace, FilteredTilesAreBitEqualToOneServerForEveryModule) {
    buildTown(30.0, 60);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3}, 0.0f, 0.02f);
    addLamp();
    look({0, 4, 28}, {0, 1, 0});
    scene->edit(viewport).set<&Viewport::gauss>(7.0f);
    const PixelSize wall{341, 227};
    for (const ShadowMode mode : kModes) {
        scene->edit(viewport).set<&Viewport::shadowMode>(mode);
        for (const std::uint32_t samples : {1u, 4u})
            for (const TileMode tiles : {TileMode::Exact, TileMode::Offset}) {
                if (samples == 4 && mode != ShadowMode::Standard && mode != ShadowMode::VolumeZFail) continue;
                WallViews views = resolved(wall, tiles);
                views.samples = samples;
                const auto whole = drawWall(views);
                ASSERT_EQ(whole.size(), 5u);
                std::size_t between = 0;
                for (const float factor : whole[3].values) between += factor > 0.05f && factor < 0.95f;
                EXPECT_GT(between, 1000u) << static_cast<int>(mode);
                SCOPED_TRACE(static_cast<int>(mode));
                expectEqualTiles(views, whole, {{2, 2}, {4, 4}});
            }
    }
}

// Blocks of offset mode end in the middle of this wall; filters look beyond them.
TEST_F(ScreenSpace, TheBlocksOfALargeWallShowNoSeam) {
    buildTown(30.0, 60);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    look({0, 4, 28}, {0, 1, 0}, 0.2);
    scene->edit(viewport)
        .set<&Viewport::gauss>(16.0f)
        .set<&Viewport::shadowMode>(ShadowMode::VolumeZFail)
        .set<&Viewport::edgeThreshold>(0.0f);
    const PixelSize wall{1300, 150};
    const auto exact = drawWall(resolved(wall, TileMode::Exact));
    const auto whole = drawWall(resolved(wall, TileMode::Offset));
    ASSERT_EQ(exact.size(), whole.size());
    std::size_t differing = 0, seam = 0, between = 0;
    for (int y = 0; y < wall.height; ++y)
        for (int x = 0; x < wall.width; ++x) {
            const float factor = exact[3].at(x, y)[0];
            const bool differs = std::abs(factor - whole[3].at(x, y)[0]) > 2.0f / 255;
            differing += differs;
            if (std::abs(x - 1024) > 16) continue;
            seam += differs;
            between += factor > 0.05f && factor < 0.95f;
        }
    EXPECT_GT(between, 200u) << "there must be something to filter across the seam";
    // The rasteriser's last bits: now and then a pixel of another surface (docs/architecture.md).
    EXPECT_LE(differing, 1300u * 150u * 5 / 10000);
    EXPECT_LE(seam, between / 100);
    const auto tiled = drawWall(resolved(wall, TileMode::Offset), 3, 2);
    EXPECT_EQ(differingPixels(whole[3], tiled[3]), 0u);
}

// A lit post stands before a floor that lies in the shadow of a roof. Where a surface is of one factor as far as the
// filter reaches, the filter must leave it.
TEST_F(ScreenSpace, NoHaloSurroundsAForegroundObject) {
    block({-30, -1, -30}, {30, 0, 30});
    block({-28, 10, -28}, {28, 10.2, 2});
    block({-0.5, 0, 9}, {0.5, 5, 9.4});
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.1, -1.0, -0.4});
    look({3, 4, 20}, {0, 1, -2});
    scene->edit(viewport).set<&Viewport::shadowMode>(ShadowMode::VolumeZFail);
    const PixelSize wall{320, 220};
    const auto direct = drawWall(resolved(wall));
    ASSERT_EQ(direct.size(), 4u);
    constexpr int kRadius = 6;
    // Pixels that a filter of a single surface keeps.
    std::vector<std::uint8_t> kept(static_cast<std::size_t>(wall.width * wall.height), 0);
    const auto sameSurface = [&](int x, int y, int a, int b) {
        const float* p = direct[1].at(x, y);
        const float* q = direct[1].at(a, b);
        const float* n = direct[2].at(x, y);
        const float* m = direct[2].at(a, b);
        const double apart = std::abs((q[0] - p[0]) * n[0] + (q[1] - p[1]) * n[1] + (q[2] - p[2]) * n[2]);
        return n[0] * m[0] + n[1] * m[1] + n[2] * m[2] > 0.999f && apart < 1e-3;
    };
    std::size_t keptCount = 0;
    for (int y = kRadius; y < wall.height - kRadius; ++y)
        for (int x = kRadius; x < wall.width - kRadius; ++x) {
            if (direct[2].at(x, y)[0] == 0.0f && direct[2].at(x, y)[1] == 0.0f) continue;
            bool uniform = true;
            for (int b = y - kRadius; b <= y + kRadius && uniform; ++b)
                for (int a = x - kRadius; a <= x + kRadius && uniform; ++a)
                    uniform = !sameSurface(x, y, a, b) || direct[3].at(a, b)[0] == direct[3].at(x, y)[0];
            kept[static_cast<std::size_t>(y * wall.width + x)] = uniform;
            keptCount += uniform;
        }
    ASSERT_GT(keptCount, 20000u);
    const auto halo = [&](float threshold) {
        scene->edit(viewport)
            .set<&Viewport::gauss>(static_cast<float>(kRadius))
            .set<&Viewport::edgeThreshold>(threshold);
        const auto filtered = drawWall(resolved(wall));
        std::size_t changed = 0, between = 0;
        for (int y = 0; y < wall.height; ++y)
            for (int x = 0; x < wall.width; ++x) {
                const float factor = filtered[3].at(x, y)[0];
                between += factor > 0.05f && factor < 0.95f;
                changed += kept[static_cast<std::size_t>(y * wall.width + x)] &&
                           std::abs(factor - direct[3].at(x, y)[0]) > 0.02f;
            }
        EXPECT_GT(between, 500u) << "shadows' edges on the floor are filtered";
        return changed;
    };
    const std::size_t without = halo(0.0f);
    const std::size_t with = halo(0.01f);
    std::printf("halo: %zu pixels without edges, %zu with, of %zu\n", without, with, keptCount);
    EXPECT_GT(without, 500u);
    EXPECT_EQ(with, 0u);
}

}  // namespace
}  // namespace umbriel
