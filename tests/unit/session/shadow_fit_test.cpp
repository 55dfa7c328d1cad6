#include "client/session/shadow_fit.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/wall/grid.h"
#include "tests/unit/session/scene_fixture.h"
#include "tests/unit/session/test_views.h"

namespace umbriel {
namespace {

using test::isSeen;
using test::mapped;
using test::viewFrom;

// With a margin for what the shader adds: normal offset and rounding, one texel.
constexpr double kTexel = 1.0;

bool onMap(const ShadowFit& fit, const glm::dvec3& world, double marginTexels = kTexel, double tolerance = 1e-9) {
    const glm::dvec3 place = mapped(fit, world);
    const double inner = 1.0 - 2.0 * marginTexels / fit.mapSize + tolerance;
    return std::abs(place.x) <= inner && std::abs(place.y) <= inner && place.z >= 0.0 && place.z <= 1.0;
}

const glm::dvec3 kDirections[] = {{1, 0, 0},     {-1, 0, 0},    {0, 1, 0},    {0, -1, 0},
                                  {0, 0, 1},     {0, 0, -1},    {1, 1, 1},    {-0.5, -1, 0.3},
                                  {1e-7, -1, 0}, {0, -1, 1e-7}, {1, 1e-9, 0}, {-3, -4, 1e-3}};

TEST(ShadowFit, SceneFitHoldsTheSceneInEveryDirectionAtEveryScale) {
    for (const glm::dvec3& direction : kDirections)
        for (const double scale : {1e-6, 1e-3, 1.0, 1e4, 1e6})
            for (const glm::dvec3& size : {glm::dvec3(1, 1, 1), glm::dvec3(10, 0.1, 3), glm::dvec3(1, 0, 1),
                                           glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 0)}) {
                const Box3d box{scale * glm::dvec3(-0.3, 0.2, 5), scale * (glm::dvec3(-0.3, 0.2, 5) + size)};
                for (const std::uint32_t mapSize : {1u, 4u, 16u, 512u, 16384u}) {
                    const auto fit = fitDirectional(direction, box, {}, {ShadowFitMode::Scene, mapSize});
                    ASSERT_TRUE(fit);
                    ASSERT_TRUE(isFinite(fit->clipFromWorld));
                    EXPECT_GT(fit->texelSize, 0.0);
                    EXPECT_GT(fit->depthRange, 0.0);
                    for (int i = 0; i < 8; ++i)
                        ASSERT_TRUE(onMap(*fit, box.corner(i), mapSize >= 16 ? kTexel : 0.0))
                            << direction.x << " " << direction.y << " " << direction.z << " scale " << scale << " map "
                            << mapSize;
                }
            }
}

TEST(ShadowFit, MapsFillTheirTexels) {
    // A straight-down sun over a square: at most 8 border texels and one step of 2^(1/8) are lost.
    const Box3d box{{-10, 0, -10}, {10, 2, 10}};
    const auto fit = fitDirectional({0, -1, 0}, box, {}, {ShadowFitMode::Scene, 512});
    EXPECT_LE(fit->texelSize, 20.0 / (512 - 4) * std::exp2(0.125) * (1 + 1e-12));
    EXPECT_GE(fit->texelSize, 20.0 / 512);
}

TEST(ShadowFit, DepthIsOneNearestTheLightAndLinear) {
    const Box3d box{{-1, -1, -1}, {1, 1, 1}};
    const auto fit = fitDirectional({0, -1, 0}, box, {}, {ShadowFitMode::Scene, 512});
    const double top = mapped(*fit, {0, 1, 0}).z, middle = mapped(*fit, {0, 0, 0}).z,
                 bottom = mapped(*fit, {0, -1, 0}).z;
    EXPECT_GT(top, middle);
    EXPECT_NEAR(middle, 0.5, 1e-12);
    EXPECT_NEAR(top - bottom, 2.0 / fit->depthRange, 1e-12);
}

TEST(ShadowFit, AMillionMetresFromTheOriginNothingIsLost) {
    const glm::dvec3 offset(1e6, -1e6, 1e6);
    const Box3d box{offset - 5.0, offset + 5.0};
    const View view = viewFrom(offset + glm::dvec3(0, 3, 12), offset, 0.8);
    for (const ShadowFitMode mode : {ShadowFitMode::Scene, ShadowFitMode::Union}) {
        const auto fit = fitDirectional({-0.3, -1, -0.2}, box, {&view, 1}, {mode, 2048});
        ASSERT_TRUE(fit);
        for (int i = 0; i < 8; ++i)
            if (mode == ShadowFitMode::Scene || isSeen(view, box.corner(i))) {
                EXPECT_TRUE(onMap(*fit, box.corner(i), kTexel, 1e-6));
            }
    }
}

// The heart of the union: whatever some view sees of the scene is on the map, with its casters above it.
void checkUnion(bool spot) {
    const auto unit = [] { return *rc::gen::inRange(-1000, 1001) * 0.001; };
    const double scale = std::pow(10.0, *rc::gen::inRange(-3, 5));
    const Box3d box{scale * glm::dvec3(-10, 0, -10), scale * glm::dvec3(10, 4, 10)};
    std::vector<View> views;
    const int count = *rc::gen::inRange(1, 4);
    for (int i = 0; i < count; ++i) {
        const glm::dvec3 eye = scale * 15.0 * glm::dvec3(unit(), unit(), unit());
        const glm::dvec3 target = scale * 10.0 * glm::dvec3(unit(), unit(), unit());
        RC_PRE(glm::distance(eye, target) > 0.01 * scale);
        views.push_back(viewFrom(eye, target, *rc::gen::element(0.05, 0.8, 2.0, 3.1), scale * 0.01));
    }
    const std::uint32_t mapSize = *rc::gen::element(16u, 100u, 512u, 4096u);
    const ShadowFitMode mode = *rc::gen::element(ShadowFitMode::Union, ShadowFitMode::Scene);
    const glm::dvec3 position = scale * glm::dvec3(12 * unit(), 9 + 5 * unit(), 12 * unit());
    const glm::dvec3 direction = spot ? glm::dvec3(unit(), -1.0, unit()) : glm::dvec3(unit(), unit(), unit());
    RC_PRE(glm::length(direction) > 0.0);
    const double outer = *rc::gen::element(0.05, 0.5, 1.2, 1.5);
    const auto fit = spot ? fitSpot(position, direction, outer, 0.0, box, views, {mode, mapSize})
                          : fitDirectional(direction, box, views, {mode, mapSize});
    for (int i = 0; i < 200; ++i) {
        const glm::dvec3 receiver = scale * glm::dvec3(10 * unit(), 2 + 2 * unit(), 10 * unit());
        bool seen = mode == ShadowFitMode::Scene;
        for (const View& view : views) seen = seen || isSeen(view, receiver);
        if (!seen) continue;
        if (spot) {
            const glm::dvec3 fromLight = receiver - position;
            const double along = glm::dot(fromLight, glm::normalize(direction));
            if (along < std::cos(outer) * glm::length(fromLight) || glm::length(fromLight) < 0.01 * scale) continue;
        }
        RC_ASSERT(fit.has_value());
        RC_ASSERT(onMap(*fit, receiver, kTexel, 1e-6));
    }
}
RC_GTEST_PROP(ShadowFit, DirectionalHoldsWhatIsSeen, ()) {
    checkUnion(false);
}
RC_GTEST_PROP(ShadowFit, SpotHoldsWhatIsSeen, ()) {
    checkUnion(true);
}

TEST(ShadowFit, CastersOutsideTheViewAreWithinTheDepth) {
    const Box3d box{{-100, 0, -100}, {100, 50, 100}};
    const View view = viewFrom({0, 2, 5}, {0, 0, 0}, 0.3);
    const glm::dvec3 direction = glm::normalize(glm::dvec3(-0.2, -1, -0.1));
    const auto fit = fitDirectional(direction, box, {&view, 1}, {ShadowFitMode::Union, 512});
    ASSERT_TRUE(fit);
    // From a seen receiver up to the top of the scene's box.
    const glm::dvec3 caster = glm::dvec3(0, 0, 0) - direction * (49.0 / -direction.y);
    EXPECT_FALSE(isSeen(view, caster));
    EXPECT_TRUE(onMap(*fit, caster));
}

TEST(ShadowFit, UnionIsFinerThanSceneForANarrowViewAndHoldsAllTiles) {
    const Box3d box{{-100, 0, -100}, {100, 10, 100}};
    const View whole = viewFrom({0, 8, 30}, {0, 0, 0}, 0.3);
    const ShadowFitRequest request{ShadowFitMode::Union, 1024};
    const auto fit = fitDirectional({-0.4, -1, -0.3}, box, {&whole, 1}, request);
    const auto scene = fitDirectional({-0.4, -1, -0.3}, box, {}, {ShadowFitMode::Scene, 1024});
    ASSERT_TRUE(fit && scene);
    EXPECT_LT(fit->texelSize, 0.5 * scene->texelSize);
    // The tiles of the wall, given instead of the whole, have the same union and so, nearly to the bit, the same map.
    const PixelSize wall{1277, 719};
    std::vector<View> tiles;
    for (const TileAssignment& tile : *gridTiles(wall, 5, 3)) {
        View part = whole;
        part.clipFromView = cropped(whole.clipFromView, tile.pixels, wall);
        tiles.push_back(part);
    }
    const auto fromTiles = fitDirectional({-0.4, -1, -0.3}, box, tiles, request);
    ASSERT_TRUE(fromTiles);
    EXPECT_EQ(fromTiles->texelSize, fit->texelSize);
    for (int c = 0; c < 4; ++c) EXPECT_LT(glm::distance(fromTiles->clipFromWorld[c], fit->clipFromWorld[c]), 1e-9);
}

TEST(ShadowFit, FlatScenesSeenEdgeOnAndLightsAlongTheViewWork) {
    const Box3d floor{{-5, 0, -5}, {5, 0, 5}};
    for (const glm::dvec3& direction : kDirections) {
        const View view = viewFrom(-8.0 * glm::normalize(direction) + glm::dvec3(0, 1e-3, 0), {0, 0, 0}, 0.9);
        const auto fit = fitDirectional(direction, floor, {&view, 1}, {ShadowFitMode::Union, 512});
        if (!fit) continue;  // the floor is outside the picture
        ASSERT_TRUE(isFinite(fit->clipFromWorld));
        EXPECT_GT(fit->texelSize, 0.0);
    }
    const auto edgeOn = fitDirectional({1, 0, 0}, floor, {}, {ShadowFitMode::Scene, 512});
    ASSERT_TRUE(edgeOn);
    EXPECT_TRUE(onMap(*edgeOn, {5, 0, 5}));
}

TEST(ShadowFit, NothingSeenIsNoMap) {
    const Box3d box{{-1, 0, -1}, {1, 1, 1}};
    const View away = viewFrom({0, 0.5, 5}, {0, 0.5, 10}, 0.8);
    EXPECT_FALSE(fitDirectional({0, -1, 0}, box, {&away, 1}, {}));
    EXPECT_FALSE(fitDirectional({0, -1, 0}, Box3d{}, {&away, 1}, {ShadowFitMode::Scene}));
    EXPECT_FALSE(fitDirectional({0, -1, 0}, box, {}, {}));
    EXPECT_FALSE(fitDirectional({0, 0, 0}, box, {}, {ShadowFitMode::Scene}));
    const View here = viewFrom({0, 0.5, 5}, {0, 0.5, 0}, 0.8);
    EXPECT_FALSE(fitSpot({0, 5, 0}, {0, 1, 0}, 0.5, 0.0, box, {&here, 1}, {}));    // shines away
    EXPECT_FALSE(fitSpot({50, 5, 0}, {0, -1, 0}, 0.1, 0.0, box, {&here, 1}, {}));  // shines past
    EXPECT_FALSE(fitSpot({0, 5, 0}, {0, -1, 0}, 0.5, 2.0, box, {&here, 1}, {}));   // does not reach
    EXPECT_TRUE(fitSpot({0, 5, 0}, {0, -1, 0}, 0.5, 0.0, box, {&here, 1}, {}));
}

// While the light sweeps over the sky, a point stays where it was on the map but for the turn itself (1.6e-4 rad a
// frame times 25 m, over texels of 2 cm or more: 0.2) and the documented texel of snapping per axis; now and then a
// side takes the next of its eight steps per octave.
TEST(ShadowFit, SmallTurnsOfTheLightMoveTheMapALittle) {
    const Box3d box{{-10, 0, -10}, {10, 5, 10}};
    const View view = viewFrom({3, 4, 16}, {0, 1, 0}, 0.7);
    glm::dvec2 last(0.0), lastScale(0.0);
    int steps = 0;
    double largest = 0.0;
    constexpr int kFrames = 20000;
    for (int i = 0; i <= kFrames; ++i) {
        // From the horizon to the other one, straight down half way, never along x.
        const double angle = 0.02 + i * (std::numbers::pi - 0.04) / kFrames;
        const glm::dvec3 direction(-0.06 * std::sin(2 * angle), -std::sin(angle), std::cos(angle));
        const auto fit = fitDirectional(direction, box, {&view, 1}, {ShadowFitMode::Union, 512});
        ASSERT_TRUE(fit);
        ASSERT_GT(fit->texelSize, 0.02);
        const glm::dmat4 rows = glm::transpose(fit->clipFromWorld);
        const glm::dvec2 scale(glm::length(glm::dvec3(rows[0])), glm::length(glm::dvec3(rows[1])));
        const glm::dvec2 texels = glm::dvec2(mapped(*fit, {1, 1, 1})) * 0.5 * 512.0;
        if (i > 0) {
            const glm::dvec2 change = glm::abs(scale / lastScale - 1.0);
            if (std::max(change.x, change.y) > 1e-9)
                ++steps;
            else
                largest = std::max(largest, glm::distance(texels, last));
        }
        last = texels;
        lastScale = scale;
    }
    EXPECT_LT(largest, std::sqrt(2.0) + 0.4);
    EXPECT_LT(steps, 100);
}

TEST(ShadowFit, WhileTheEyeMovesTheMapMovesInWholeTexels) {
    const Box3d box{{-50, 0, -50}, {50, 5, 50}};
    const glm::dvec3 direction(-0.4, -1, -0.3);
    double lastX = 0.0, lastTexel = 0.0;
    int unchanged = 0;
    for (int i = 0; i < 200; ++i) {
        const View view = viewFrom({0.01 * i, 6, 16}, {0.01 * i, 0, 0}, 0.5);
        const auto fit = fitDirectional(direction, box, {&view, 1}, {ShadowFitMode::Union, 512});
        ASSERT_TRUE(fit);
        const double x = mapped(*fit, {0, 0, 0}).x * 0.5 * 512.0;
        if (i > 0 && fit->texelSize == lastTexel) {
            EXPECT_NEAR(x - lastX, std::round(x - lastX), 1e-8);
            if (std::abs(x - lastX) < 1e-8) ++unchanged;
        }
        lastX = x;
        lastTexel = fit->texelSize;
    }
    EXPECT_GT(unchanged, 100);
}

TEST(ShadowFit, SpotMapsAreTheConesPictureInReversedDepth) {
    const Box3d box{{-10, 0, -10}, {10, 1, 10}};
    const auto fit = fitSpot({0, 8, 0}, {0, -1, 0}, 0.4, 0.0, box, {}, {ShadowFitMode::Scene, 512});
    ASSERT_TRUE(fit);
    EXPECT_TRUE(fit->perspective);
    EXPECT_NEAR((fit->clipFromWorld * glm::dvec4(3, 2, 1, 1)).w, 6.0, 1e-12);  // w is the distance along the axis
    EXPECT_GT(mapped(*fit, {0, 1, 0}).z, mapped(*fit, {0, 0, 0}).z);
    EXPECT_NEAR(fit->texelSize, 2.0 * std::tan(0.4) / 508, 1e-12);
    for (int i = 0; i < 64; ++i) {
        const double angle = 0.1 * i;
        const double radius = std::tan(0.4) * 8.0;
        EXPECT_TRUE(onMap(*fit, {radius * std::cos(angle), 0.0, radius * std::sin(angle)}));
    }
}

TEST(ShadowFit, BiasesAreAutomaticUnlessGiven) {
    const Box3d box{{-1, -1, -1}, {1, 1, 1}};
    const auto fit = [&](float offFactor, float offBias) {
        return *fitDirectional({0, -1, 0}, box, {}, {ShadowFitMode::Scene, 512, offFactor, offBias});
    };
    EXPECT_EQ(fit(-1, -1).normalOffset, kNormalOffset);
    EXPECT_EQ(fit(-1, -1).slopeBias, 0.0f);
    EXPECT_EQ(fit(-1, -1).constantBias, kConstantBias);
    EXPECT_EQ(fit(4, 10).slopeBias, 4.0f);
    EXPECT_EQ(fit(4, 10).normalOffset, 0.0f);
    EXPECT_EQ(fit(4, 10).constantBias, 10.0f);
    EXPECT_EQ(fit(-1, 3).normalOffset, kNormalOffset);
}

TEST(ShadowFit, MapSizesAreResolvedAndClamped) {
    std::vector<std::string> messages;
    EXPECT_EQ(resolveMapSize(0, {1277, 719}, 16384, messages), 512u);
    EXPECT_EQ(resolveMapSize(0, {1, 5}, 16384, messages), 1u);
    EXPECT_EQ(resolveMapSize(0, {65536, 65536}, 16384, messages), 16384u);
    EXPECT_EQ(messages.size(), 1u);
    EXPECT_EQ(resolveMapSize(777, {10, 10}, 16384, messages), 777u);
    EXPECT_EQ(resolveMapSize(4000000000u, {10, 10}, 16384, messages), 16384u);
    EXPECT_EQ(messages.size(), 2u);
}

class LightFits : public SceneFixture {
 protected:
    ShadowFits fits(const ShadowFitRequest& request = {ShadowFitMode::Scene, 512}) {
        return fitShadows(aspect, lightsInEffect(aspect, root, Hierarchy(aspect, root)), worldBounds(aspect, root), {},
                          request);
    }
};

TEST_F(LightFits, PointLightsOutsideTheSceneGetASpotsMapAndInsideACube) {
    addBox({-1, -1, -1}, {1, 1, 1});
    const auto light = aspect.create<PointLight>("lamp");
    const Ref<Node> lamp = node(root, any(light));
    const auto put = [&](const glm::dvec3& where) { aspect.edit(light).set<&PointLight::beacon>(placed(root, where)); };
    for (const double distance : {2.1, 3.0, 1e3, 1e6}) {
        put(distance * glm::normalize(glm::dvec3(1, 2, -0.5)));
        const ShadowFits result = fits();
        ASSERT_EQ(result.fits.size(), 1u) << distance;
        EXPECT_EQ(result.fits[0].light, lamp.id);
        EXPECT_TRUE(result.messages.empty());
        for (int i = 0; i < 8; ++i)
            EXPECT_TRUE(onMap(result.fits[0], Box3d{glm::dvec3(-1), glm::dvec3(1)}.corner(i))) << distance;
    }
    // Nearer than one map can see, and inside: six faces, in order.
    for (const glm::dvec3& where : {glm::dvec3(1.1, 1.1, 1.1), glm::dvec3(0.2, 0.1, 0)}) {
        put(where);
        const ShadowFits result = fits();
        EXPECT_TRUE(result.messages.empty());
        ASSERT_EQ(result.fits.size(), 6u);
        for (std::uint32_t part = 0; part < 6; ++part) {
            EXPECT_EQ(result.fits[part].shape, ShadowShape::CubeFace);
            EXPECT_EQ(result.fits[part].part, part);
        }
    }
}

// Whose maps all around would show the scene in a few texels, or in none.
TEST_F(LightFits, FarPointLightsHaveOneMapInEveryModeAndSaySo) {
    addBox({-1, -1, -1}, {1, 1, 1});
    const auto light = aspect.create<PointLight>("lamp");
    node(root, any(light));
    for (const ShadowMode mode : {ShadowMode::Cube, ShadowMode::DualParaboloid})
        for (const double distance : {3.0, 6.6, 6.8, 1e3, 1e8}) {
            aspect.edit(light).set<&PointLight::beacon>(
                placed(root, distance * glm::normalize(glm::dvec3(1, 2, -0.5))));
            ShadowFitRequest request{ShadowFitMode::Scene, 512};
            request.mode = mode;
            const ShadowFits result = fits(request);
            const bool isFar = std::sqrt(3.0) / distance < std::sin(kNarrowestAround);
            ASSERT_EQ(result.fits.size(), isFar ? 1u : mode == ShadowMode::Cube ? 6u : 2u) << distance;
            EXPECT_EQ(result.messages.size(), isFar ? 1u : 0u);
            EXPECT_EQ(result.fits[0].shape == ShadowShape::Single, isFar) << distance;
        }
}

// A penumbra's measure is a width: of a sun that of its disc a metre away, of a lamp its diameter.
TEST_F(LightFits, LightsAreTwiceAsWideAsTheirRadiusSays) {
    addBox({-1, -1, -1}, {1, 1, 1});
    const auto sun = aspect.create<DirectionalLight>("sun");
    aspect.edit(sun).set<&DirectionalLight::angularRadius>(0.3f);
    node(placed(root, {0, 0, 4}), any(sun));
    const auto spot = aspect.create<SpotLight>("spot");
    aspect.edit(spot).set<&SpotLight::radius>(0.25f);
    node(placed(root, {0, 0, 4}), any(spot));
    const auto lamp = aspect.create<PointLight>("lamp");
    aspect.edit(lamp).set<&PointLight::radius>(0.5f);
    node(placed(root, {0, 0, 4}), any(lamp));
    const auto widths = [&](float lightSize) {
        ShadowFitRequest request{ShadowFitMode::Scene, 512};
        request.lightSize = lightSize;
        std::vector<float> all;
        for (const ShadowFit& fit : fits(request).fits) all.push_back(fit.filter.lightSize);
        std::sort(all.begin(), all.end());
        return all;
    };
    const std::vector<float> own = widths(-1.0f);
    ASSERT_EQ(own.size(), 3u);
    EXPECT_EQ(own[0], 0.5f);
    EXPECT_NEAR(own[1], 2.0 * std::tan(0.3), 1e-6);
    EXPECT_EQ(own[2], 1.0f);
    // The viewport's own measure: metres across, radians across.
    const std::vector<float> given = widths(0.4f);
    EXPECT_EQ(given[0], 0.4f);
    EXPECT_EQ(given[1], 0.4f);
    EXPECT_NEAR(given[2], 2.0 * std::tan(0.2), 1e-6);
}

TEST_F(LightFits, ShadowlessLightsAreSkipped) {
    addBox({-1, -1, -1}, {1, 1, 1});
    const auto spot = aspect.create<SpotLight>("spot");
    node(placed(root, {0, 0, 4}), any(spot));
    EXPECT_EQ(fits().fits.size(), 1u);
    aspect.edit(spot).set<&SpotLight::castsShadow>(false);
    EXPECT_TRUE(fits().fits.empty());
    EXPECT_TRUE(fits().messages.empty());
}

TEST_F(LightFits, AreTheSameEveryTimeAndSortedByLight) {
    addBox({-1, -1, -1}, {1, 1, 1});
    for (int i = 0; i < 3; ++i) node(root, any(aspect.create<DirectionalLight>()));
    const ShadowFits a = fits(), b = fits();
    ASSERT_EQ(a.fits.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(a.fits[i].clipFromWorld, b.fits[i].clipFromWorld);
        if (i > 0) {
            EXPECT_LT(a.fits[i - 1].light, a.fits[i].light);
        }
    }
}

}  // namespace
}  // namespace umbriel
