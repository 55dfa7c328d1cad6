#include <chrono>

#include "tests/shadows/shadow_fixture.h"

namespace umbriel {
namespace {

class Filters : public ModuleTest {
 protected:
    std::vector<WallImage> factorsOf(ShadowMode mode, PixelSize wall = {320, 200}) {
        scene->edit(viewport).set<&Viewport::shadowMode>(mode);
        return drawWall(resolved(wall));
    }
};

// Looking at the bounds of a map first saves samples and loses nothing: against 32 x 32 samples, what skips is no
// farther off than the plain loop of as many samples as asked for.
TEST_F(Filters, SkippingSamplesIsNoLessAccurateThanThePlainLoop) {
    buildTown();
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3}, 0.0f, 0.02f);
    look({0, 4, 50}, {0, 1, 0});
    scene->edit(viewport).set<&Viewport::mapSize>(1024u);
    const auto rmse = [](const WallImage& a, const WallImage& b) {
        double squares = 0.0;
        for (std::size_t i = 0; i < a.values.size(); ++i)
            squares += double(a.values[i] - b.values[i]) * double(a.values[i] - b.values[i]);
        return std::sqrt(squares / double(a.values.size()));
    };
    const auto samples = [&](std::uint32_t search, std::uint32_t filter, std::uint32_t row, bool skip) {
        scene->edit(viewport)
            .set<&Viewport::blockerSamples>(search)
            .set<&Viewport::filterSamples>(filter)
            .set<&Viewport::samplesPerRow>(row)
            .set<&Viewport::skipUniform>(skip);
    };
    for (const ShadowMode mode : {ShadowMode::PercentageCloser, ShadowMode::PercentageCloserSoft})
        for (const ShadowMode map : {ShadowMode::Standard, ShadowMode::LightSpacePerspective})
            for (const bool bilinear : {false, true}) {
                scene->edit(viewport).set<&Viewport::filteredMap>(map).set<&Viewport::hardwareFilter>(bilinear);
                samples(6, 8, 6, true);
                const auto skipping = factorsOf(mode);
                // The search for blockers is wider than a block: nothing could be decided by its bounds.
                const bool isSoft = mode == ShadowMode::PercentageCloserSoft;
                EXPECT_EQ(renderer->explain().find("shadow bounds") == std::string::npos, isSoft);
                samples(6, 8, 6, false);
                const auto plain = factorsOf(mode);
                EXPECT_EQ(renderer->explain().find("shadow bounds"), std::string::npos);
                samples(32, 32, 32, false);
                const auto dense = factorsOf(mode);
                ASSERT_EQ(skipping.size(), 4u);
                std::size_t soft = 0;
                for (const float value : plain[3].values) soft += value > 0.0f && value < 1.0f;
                EXPECT_GT(soft, 500u);
                const double skipped = rmse(skipping[3], dense[3]), all = rmse(plain[3], dense[3]);
                std::printf("module %d on %d%s: rmse %.5f, plain loop %.5f\n", int(mode), int(map),
                            bilinear ? ", bilinear" : "", skipped, all);
                EXPECT_LE(skipped, all * 1.0001);
                // Sums of rounded numbers in another order may decide otherwise where a depth is equal to its bias.
                EXPECT_LE(differingPixels(skipping[3], plain[3]), 6u);
            }
}

// 6 and 8 samples a row are written out by the compiler, other numbers are not; all read copies of the maps.
TEST_F(Filters, AnyNumberOfSamplesIsWhatThePlainLoopTakes) {
    buildTown();
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3}, 0.0f, 0.02f);
    look({0, 4, 50}, {0, 1, 0});
    const PixelSize wall{160, 100};
    for (const ShadowMode mode : {ShadowMode::PercentageCloser, ShadowMode::PercentageCloserSoft})
        for (const std::uint32_t row : {3u, 5u, 6u, 8u}) {
            scene->edit(viewport)
                .set<&Viewport::blockerSamples>(row)
                .set<&Viewport::filterSamples>(row)
                .set<&Viewport::samplesPerRow>(row)
                .set<&Viewport::skipUniform>(true);
            const auto skipping = factorsOf(mode, wall);
            EXPECT_NE(renderer->explain().find("shadow map copies"), std::string::npos);
            scene->edit(viewport).set<&Viewport::skipUniform>(false);
            const auto plain = factorsOf(mode, wall);
            EXPECT_EQ(renderer->explain().find("shadow map copies"), std::string::npos);
            ASSERT_EQ(skipping.size(), 4u);
            ASSERT_EQ(plain.size(), 4u);
            std::size_t soft = 0;
            for (const float value : plain[3].values) soft += value > 0.0f && value < 1.0f;
            EXPECT_GT(soft, 100u);
            // As above: the bounds of blocks are sums of rounded numbers.
            EXPECT_LE(differingPixels(skipping[3], plain[3]), 2u) << int(mode) << ", " << row << " a row";
        }
}

TEST_F(Filters, ALightWithoutExtentCastsTheHardShadow) {
    buildTown();
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    look({0, 4, 50}, {0, 1, 0});
    scene->edit(viewport).set<&Viewport::mapSize>(1024u).set<&Viewport::lightSize>(0.0f);
    for (const auto& [map, mode] : {std::pair(ShadowMode::Standard, ShadowMode::Standard),
                                    std::pair(ShadowMode::Trapezoid, ShadowMode::Trapezoid)}) {
        scene->edit(viewport).set<&Viewport::filteredMap>(map);
        const auto soft = factorsOf(ShadowMode::PercentageCloserSoft);
        ASSERT_EQ(soft.size(), 4u);
        std::size_t between = 0;
        for (std::size_t i = 0; i < soft[3].values.size(); i += 4)
            between += soft[3].values[i] > 0.0f && soft[3].values[i] < 1.0f;
        EXPECT_EQ(between, 0u);
        const Errors softly = errorsOf(soft, {320, 200});
        const Errors hard = errorsOf(factorsOf(mode), {320, 200});
        // The filter's border makes its texels a little larger.
        EXPECT_LE(softly.error, hard.error + 0.002);
    }
}

// A wall's edge over the floor, lit at 45 degrees by a disc: behind the edge, at height h, the penumbra on the floor is
// as wide across the light as the disc makes it at that distance.
TEST_F(Filters, PenumbraeAreAsWideAsTheLightMakesThem) {
    for (const double height : {2.0, 4.0, 8.0}) {
        SetUp();
        block({-20, -1, -20}, {20, 0, 20});
        block({-15, height, -20}, {0, height + 0.02, 20});  // a roof that ends at x = 0
        const double radius = 0.05;                         // radians
        finishScene(LightPlace::Directional, {0, 0, 0}, {0, -1, 0}, 0.0f, float(radius));
        scene->edit(viewport)
            .set<&Viewport::mapSize>(256u)  // so that the widest penumbra is less than maxPenumbra
            .set<&Viewport::maxPenumbra>(128.0f)
            .set<&Viewport::filterSamples>(16u);
        // From below the roof's height, looking down at the floor under its edge.
        look({0.8, 1.9, 0}, {0, 0, 0}, 0.8);
        const PixelSize wall{200, 400};
        const auto images = factorsOf(ShadowMode::PercentageCloserSoft, wall);
        ASSERT_EQ(images.size(), 4u);
        const glm::dvec3 eye = resolved(wall).views[0].eyeWorld;
        double first = 1e9, last = -1e9;
        for (int y = 0; y < wall.height; ++y)
            for (int x = 0; x < wall.width; ++x) {
                const float* n = images[2].at(x, y);
                const float* p = images[1].at(x, y);
                const glm::dvec3 point = (eye + glm::dvec3(p[0], p[1], p[2])) * worldFromLocal;
                if (n[1] < 0.5f || point.y > 0.01 || std::abs(point.z) > 0.2) continue;
                const double factor = images[3].at(x, y)[0];
                const double place = point.x;
                if (factor > 0.02 && factor < 0.98) {
                    first = std::min(first, place);
                    last = std::max(last, place);
                }
            }
        // Of a disc, 2 and 98 percent lie 0.102 of its radius within its rim.
        const double wanted = (1.0 - 0.102) * 2.0 * height * std::tan(radius);
        std::printf("roof at %g m: penumbra %.3f m, the light's %.3f m\n", height, last - first, wanted);
        EXPECT_NEAR(last - first, wanted, 0.15 * wanted);
    }
}

TEST_F(Filters, NoBlockerIsLitAndAllBlockedIsDark) {
    block({-20, -1, -20}, {20, 0, 20});
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.3, -1, 0.2}, 0.0f, 0.3f);
    look({0, 5, 12}, {0, 0, 0});
    auto images = factorsOf(ShadowMode::PercentageCloserSoft);
    ASSERT_EQ(images.size(), 4u);
    for (int y = 0; y < 200; ++y)
        for (int x = 0; x < 320; ++x)
            if (images[2].at(x, y)[1] > 0.5f) {
                ASSERT_EQ(images[3].at(x, y)[0], 1.0f) << x << " " << y;
            }
    SetUp();
    block({-20, -1, -20}, {20, 0, 20});
    block({-60, 3, -60}, {60, 3.5, 60});
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.3, -1, 0.2}, 0.0f, 0.3f);
    look({0, 2, 12}, {0, 0, 0});
    images = factorsOf(ShadowMode::PercentageCloserSoft);
    ASSERT_EQ(images.size(), 4u);
    for (int y = 0; y < 200; ++y)
        for (int x = 0; x < 320; ++x)
            if (images[2].at(x, y)[1] > 0.5f && images[1].at(x, y)[1] < -1.9f) {
                ASSERT_EQ(images[3].at(x, y)[0], 0.0f) << x << " " << y;
            }
}

// Coplanar receivers and blockers, a light larger than the map, one that touches a caster: finite, and between 0 and 1.
TEST_F(Filters, ExtremeLightsStayBetweenDarkAndLit) {
    for (const float radius : {1e-6f, 0.5f, 50.0f})
        for (const double height : {3.0, 2.0001, 1.0}) {
            SetUp();
            block({-5, -1, -5}, {5, 0, 5});
            block({-1, 0, -1}, {1, 2, 1});
            finishScene(LightPlace::Spot, {0, height, 0}, {0, -1, 0.01}, 1.2f, radius);
            look({3, 4, 8}, {0, 0, 0});
            const auto images = factorsOf(ShadowMode::PercentageCloserSoft);
            ASSERT_EQ(images.size(), 4u);
            for (const float value : images[3].values) ASSERT_TRUE(value >= 0.0f && value <= 1.0f);
        }
}

// A figure, not a bound: the machine is shared.
TEST_F(Filters, CostOfSkipping) {
    buildTown(60.0, std::getenv("HOUSES") ? std::atoi(std::getenv("HOUSES")) : 400);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3}, 0.0f, 0.02f);
    look({0, 4, 50}, {0, 1, 0});
    scene->edit(viewport).set<&Viewport::mapSize>(1024u).set<&Viewport::blockerSamples>(6u).set<&Viewport::reuseMaps>(
        true);
    const PixelSize wall{1280, 720};
    const auto cost = [&](ShadowMode mode, bool skip) {
        scene->edit(viewport).set<&Viewport::shadowMode>(mode).set<&Viewport::skipUniform>(skip);
        WallViews views = resolved(wall, TileMode::Offset);
        views.layers = static_cast<std::uint32_t>(Layer::Colour);
        sync();
        const TileAssignment tile{0, {0, 0, wall.width, wall.height}, Eye::Mono};
        std::vector<double> times;
        for (int i = 0; i < 12; ++i) {
            const std::clock_t start = std::clock();
            EXPECT_TRUE(renderer->draw(*scene, views, {&tile, 1}, 0.0));
            times.push_back(1000.0 * double(std::clock() - start) / CLOCKS_PER_SEC);
        }
        std::sort(times.begin(), times.end());
        return times[times.size() / 2];
    };
    const double std = cost(ShadowMode::Standard, true);
    std::printf("CPU ms: std %.1f, lisp %.1f, trapez %.1f, psm %.1f\n", std,
                cost(ShadowMode::LightSpacePerspective, true), cost(ShadowMode::Trapezoid, true),
                cost(ShadowMode::Perspective, true));
    for (const ShadowMode mode : {ShadowMode::PercentageCloser, ShadowMode::PercentageCloserSoft}) {
        const double skipping = cost(mode, true), all = cost(mode, false);
        std::printf("filter %d: %.1f, plain loop %.1f: %.2f of it, %.2f x std\n", int(mode), skipping, all,
                    skipping / all, skipping / std);
    }
}

}  // namespace
}  // namespace umbriel
