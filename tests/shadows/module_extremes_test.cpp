#include "tests/shadows/shadow_fixture.h"

namespace umbriel {
namespace {

constexpr ShadowMode kHard[] = {ShadowMode::Standard,    ShadowMode::Perspective,    ShadowMode::LightSpacePerspective,
                                ShadowMode::Trapezoid,   ShadowMode::DualParaboloid, ShadowMode::Cube,
                                ShadowMode::VolumeZPass, ShadowMode::VolumeZFail};
constexpr ShadowMode kWarps[] = {ShadowMode::Perspective, ShadowMode::LightSpacePerspective, ShadowMode::Trapezoid};

class Extremes : public ModuleTest {
 protected:
    void use(ShadowMode mode, std::uint32_t mapSize = 1024) {
        scene->edit(viewport).set<&Viewport::shadowMode>(mode).set<&Viewport::mapSize>(mapSize);
    }
};

// The angles of case 1: a warp is never worse than no warp.
TEST_F(Extremes, WarpsAreNoWorseThanTheUniformMapAtAnyAngleToTheView) {
    for (const double degrees : {0.0, 1e-6, 0.5, 1.0, 2.0, 5.0, 90.0, 179.0}) {
        SetUp();
        buildTown(60.0, 150);
        // The view looks down by 25 degrees; the light turns from its direction to the zenith and on.
        const double down = 25.0 / 57.29577951308232, angle = down + degrees / 57.29577951308232;
        finishScene(LightPlace::Directional, {0, 0, 0}, {0.0, -std::sin(angle), -std::cos(angle)});
        look({0, 12, 50}, {0, 12 - 50 * std::tan(down), 0});
        use(ShadowMode::Standard);
        const Errors uniform = measure();
        for (const ShadowMode mode : kWarps) {
            use(mode);
            const Errors warped = measure();
            std::printf("%g degrees, module %d: %.3f %%, uniform %.3f %%\n", degrees, int(mode), 100 * warped.error,
                        100 * uniform.error);
            EXPECT_LE(warped.error, 1.1 * uniform.error + 0.0005) << degrees << " " << int(mode);
        }
    }
}

// Behind the eye, far above the picture, and beside it stands what darkens what is seen; a wall of a millimetre keeps
// the light away as well as a thick one.
TEST_F(Extremes, CastersOutsideThePictureAndThinWallsCast) {
    block({-40, -1, -40}, {40, 0, 40});
    block({-8, 0, 24}, {8, 30, 25});      // behind the eye
    block({-21, 30, 22}, {-16, 31, 27});  // above
    block({-30, 0, -3}, {-12, 9, -2});    // beside
    block({1, 0, -8}, {6, 3, -7.999});    // thin
    block({4, 1.5, 3}, {4.001, 4, 8});    // thin, the other way, in the air
    for (const ShadowMode mode : kHard) {
        const auto kept = blocks;
        SetUp();
        blocks = kept;
        finishScene(LightPlace::Directional, {0, 0, 0}, {0.35, -0.6, -0.55});
        look({0, 4, 16}, {0, 0, -2});
        use(mode, 2048);
        edgeMetres = 0.4;  // a pixel on the floor, far away, is as long
        const Errors errors = measure();
        std::printf("module %d: error %.3f %%, away from edges %.3f %%; %zu of %zu dark\n", int(mode),
                    100 * errors.error, 100 * errors.inner, errors.dark, errors.judged);
        EXPECT_GT(errors.dark, 10000u);
        EXPECT_LE(errors.error, 0.006) << int(mode);
        EXPECT_LE(errors.inner, 1e-4) << int(mode);
        // Volumes have no texels: all that is left is rounding.
        if (mode == ShadowMode::VolumeZPass || mode == ShadowMode::VolumeZFail) {
            EXPECT_LE(errors.error, 1e-4) << int(mode);
        }
    }
}

// Nothing casts, for what could lies behind all that is seen: everything is lit, to the bit.
TEST_F(Extremes, CastersBehindTheReceiversAndEmptyPicturesHarmNothing) {
    for (const LightPlace place : {LightPlace::Directional, LightPlace::Spot, LightPlace::Point})
        for (const ShadowMode mode : kHard) {
            SetUp();
            block({-10, -0.5, -10}, {10, 0, 10});
            block({-2, -4, -2}, {2, -3, 2});
            finishScene(place, {0.5, 6, 1}, {0.02, -1, 0.03}, 1.2f);
            look({0, 5, 9}, {0, 0, 0});
            use(mode, 256);
            const auto images = drawWall(resolved({160, 100}));
            ASSERT_EQ(images.size(), 4u);
            std::size_t floor = 0;
            for (int y = 0; y < 100; ++y)
                for (int x = 0; x < 160; ++x)
                    if (images[2].at(x, y)[1] > 0.9f) {
                        ++floor;
                        ASSERT_EQ(images[3].at(x, y)[0], 1.0f) << int(mode) << " " << x << " " << y;
                    }
            EXPECT_GT(floor, 5000u);
            // Away from everything: the background, no number that is none.
            look({0, 5, 30}, {0, 20, 90});
            for (const WallImage& image : drawWall(resolved({160, 100})))
                for (const float value : image.values) ASSERT_TRUE(std::isfinite(value));
        }
}

// A lamp in a box lights nothing outside, and a lamp on a caster's face nothing behind it.
TEST_F(Extremes, ALampInsideAClosedMeshIsKeptThere) {
    for (const ShadowMode mode : {ShadowMode::Standard, ShadowMode::Cube, ShadowMode::DualParaboloid,
                                  ShadowMode::VolumeZPass, ShadowMode::VolumeZFail})
        for (const glm::dvec3& lamp : {glm::dvec3(0.1, 2.05, 0.03), glm::dvec3(0.1, 2.35, 0.03)}) {
            SetUp();
            block({-10, -1, -10}, {10, 0, 10});
            block({-0.4, 1.6, -0.4}, {0.4, 2.4, 0.4});
            block({3, 0, -1}, {4, 1, 1});
            finishScene(LightPlace::Point, lamp, {0, -1, 0});
            look({2, 4, 9}, {0, 0.5, 0});
            use(mode);
            const Errors errors = measure();
            EXPECT_GT(errors.dark, 20000u);
            EXPECT_LE(errors.error, 1e-4) << int(mode) << " " << lamp.y;
        }
}

// A lamp that touches what casts: on its upper face, half of the world is dark, to the plane of that face. Volumes have
// no texels. The map's are 2/2048 m wide at a metre: half of one, and the receiver's offset of 0.55, may be off.
TEST_F(Extremes, ALampOnACasterDarkensWhatLiesBehindIt) {
    for (const ShadowMode mode : {ShadowMode::Cube, ShadowMode::VolumeZPass, ShadowMode::VolumeZFail}) {
        SetUp();
        block({-10, -1, -10}, {10, 0, 10});
        block({-0.4, 1.6, -0.4}, {0.4, 2.0, 0.4});
        block({3, 0, -3}, {4, 5, 3});
        finishScene(LightPlace::Point, {0.1, 2.0, 0.03}, {0, -1, 0});
        look({-2, 6, 9}, {0, 0.5, 0});
        use(mode, 2048);
        edgeAngle = mode == ShadowMode::Cube ? (0.5 + 0.55) * 2.0 / 2048 : 0.0;
        const Errors errors = measure();
        std::printf("module %d: error %.3f %%, inner %.3f %%, %zu dark\n", int(mode), 100 * errors.error,
                    100 * errors.inner, errors.dark);
        EXPECT_GT(errors.dark, 1000u);
        EXPECT_LE(mode == ShadowMode::Cube ? errors.inner : errors.error, 1e-5) << int(mode);
    }
}

// Beyond what one map can see: a hemisphere of light has shadows up to its rim.
TEST_F(Extremes, ASpotOf180DegreesHasShadowsUpToItsRim) {
    for (const ShadowMode mode :
         {ShadowMode::Standard, ShadowMode::LightSpacePerspective, ShadowMode::DualParaboloid}) {
        SetUp();
        block({-30, -1, -30}, {30, 0, 30});
        for (int i = 0; i < 8; ++i) block({2.5 * i + 1, 0, -0.4}, {2.5 * i + 1.3, 1.9, 0.4});
        finishScene(LightPlace::Spot, {0, 2, 0}, {0, -1, 0}, 1.5707963f);
        look({9, 7, 9}, {9, 0, 0}, 1.4);
        use(mode, 2048);
        const Errors errors = measure();
        EXPECT_EQ(warnings.size(), 1u);
        EXPECT_GT(errors.dark, 5000u);
        EXPECT_LE(errors.error, 0.006) << int(mode);
    }
}

// A lamp in the plane of planar shadows: no shadow on it, nothing inverted, everything finite.
TEST_F(Extremes, ALampInThePlaneOfPlanarShadowsCastsNone) {
    for (const ShadowMode mode : {ShadowMode::Planar, ShadowMode::PlanarStencil})
        for (const double height : {0.0, -2.0}) {
            SetUp();
            block({-10, -1, -10}, {10, 0, 10});
            block({-1, 1, -1}, {1, 2, 1});
            finishScene(LightPlace::Point, {3, height, 0}, {0, -1, 0});
            look({0, 5, 9}, {0, 0, 0});
            use(mode);
            scene->edit(viewport).set<&Viewport::planeNormal>(glm::dvec3(0, 1, 0)).set<&Viewport::planeOffset>(0.0);
            const auto images = drawWall(resolved({160, 100}));
            ASSERT_EQ(images.size(), 4u);
            EXPECT_EQ(warnings.size(), 1u);
            for (int y = 0; y < 100; ++y)
                for (int x = 0; x < 160; ++x) {
                    for (int c = 0; c < 3; ++c) ASSERT_TRUE(std::isfinite(images[0].at(x, y)[c]));
                    if (images[2].at(x, y)[1] > 0.9f) {
                        ASSERT_EQ(images[3].at(x, y)[0], 1.0f);
                    }
                }
        }
}

}  // namespace
}  // namespace umbriel
