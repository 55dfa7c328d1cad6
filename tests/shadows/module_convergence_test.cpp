#include "tests/shadows/shadow_fixture.h"

namespace umbriel {
namespace {

class Convergence : public ModuleTest {
 protected:
    Errors at(ShadowMode mode, std::uint32_t mapSize, ShadowFitMode fit = ShadowFitMode::Union) {
        scene->edit(viewport)
            .set<&Viewport::shadowMode>(mode)
            .set<&Viewport::mapSize>(mapSize)
            .set<&Viewport::shadowFit>(fit);
        const Errors errors = measure();
        std::printf("%-10s %5u texels: error %.3f %% = leak %.3f + acne %.3f; %zu judged, %zu dark\n",
                    mode == ShadowMode::Standard                ? "std"
                    : mode == ShadowMode::LightSpacePerspective ? "lisp"
                    : mode == ShadowMode::Trapezoid             ? "trapez"
                    : mode == ShadowMode::Perspective           ? "psm"
                    : mode == ShadowMode::Cube                  ? "cube"
                    : mode == ShadowMode::DualParaboloid        ? "paraboloid"
                                                                : "filter",
                    mapSize, 100 * errors.error, 100 * errors.leak, 100 * errors.acne, errors.judged, errors.dark);
        return errors;
    }
    // Twice the texels, at most 0.7 of the error, until it is 0.1 %; then it stays there.
    void converges(ShadowMode mode, ShadowFitMode fit = ShadowFitMode::Union) {
        double last = 1.0;
        for (const std::uint32_t mapSize : {512u, 1024u, 2048u, 4096u}) {
            const Errors errors = at(mode, mapSize, fit);
            ASSERT_GT(errors.judged, 20000u);
            ASSERT_GT(errors.dark, 1000u);
            EXPECT_LE(errors.error, std::max(0.7 * last, 0.001)) << mapSize;
            last = errors.error;
        }
    }
};

TEST_F(Convergence, OfDirectionalMaps) {
    buildTown();
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    look({0, 2.5, 50}, {0, 1, 0});
    converges(ShadowMode::Standard, ShadowFitMode::Scene);
    converges(ShadowMode::Standard);
    converges(ShadowMode::LightSpacePerspective);
    converges(ShadowMode::Trapezoid);
    converges(ShadowMode::Perspective);
}

TEST_F(Convergence, OfSpotMaps) {
    buildTown();
    finishScene(LightPlace::Spot, {-50, 60, 40}, {0.6, -0.8, -0.45}, 0.65f);
    look({0, 2.5, 50}, {0, 1, 0});
    converges(ShadowMode::Standard);
    converges(ShadowMode::LightSpacePerspective);
    converges(ShadowMode::Trapezoid);
    converges(ShadowMode::Perspective);
}

TEST_F(Convergence, OfMapsAllAroundALight) {
    buildTown();
    finishScene(LightPlace::Point, {3.3, 4.1, 20.7}, {0, -1, 0});
    look({0, 6, 50}, {0, 1, 0});
    converges(ShadowMode::Standard);
    converges(ShadowMode::Cube);
    double last = 1.0;
    for (const std::uint32_t mapSize : {512u, 1024u, 2048u, 4096u}) {
        const Errors errors = at(ShadowMode::DualParaboloid, mapSize);
        EXPECT_LE(errors.error, last + 0.0005) << mapSize;
        last = errors.error;
    }
    EXPECT_LE(last, 0.01);
}

// The thesis' claim: warped maps of 512 texels beat the whole scene's plain map of 1024.
TEST_F(Convergence, WarpedMapsOf512BeatThePlainSceneMapOf1024) {
    buildTown();
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    look({0, 2.5, 50}, {0, 1, 0});
    const double plain = at(ShadowMode::Standard, 1024, ShadowFitMode::Scene).error;
    EXPECT_LT(at(ShadowMode::LightSpacePerspective, 512).error, plain);
    EXPECT_LT(at(ShadowMode::Trapezoid, 512).error, plain);
}

// 1e-3 to 1e4 m, and a million metres from the origin.
TEST_F(Convergence, DefaultsHoldAtEveryScaleAndPlace) {
    for (const double size : {1e-3, 1e-1, 1.0, 1e2, 1e4})
        for (const double away : {0.0, 1e6}) {
            if (away > 0.0 && size < 1.0) continue;  // nodes keep doubles, but a picture of millimetres there does not
            for (const ShadowMode mode : {ShadowMode::Standard, ShadowMode::LightSpacePerspective,
                                          ShadowMode::Trapezoid, ShadowMode::Perspective}) {
                SetUp();
                scale = size;
                offset = glm::dvec3(away, -away, away);
                buildTown(20.0, 40);
                finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
                look({0, 2.5, 18}, {0, 1, 0});
                std::printf("scale %g, %g m away: ", size, away);
                scene->edit(viewport).set<&Viewport::shadowMode>(mode).set<&Viewport::mapSize>(2048u);
                edgeMetres = 1.5 * resolved({480, 300}).views[0].fits.at(0).texelSize;
                const Errors errors = at(mode, 2048);
                EXPECT_GT(errors.judged, 20000u);
                EXPECT_LT(errors.error, 0.004);
                EXPECT_LT(errors.inner, 0.001);
                if (errors.inner > 0.0) std::printf("  away from edges: %.3f %%\n", 100 * errors.inner);
            }
        }
}

}  // namespace
}  // namespace umbriel
