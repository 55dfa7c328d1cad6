// What filters tend to as maps grow, what has no texels at all, and the defaults at every scale and place.

#include "tests/shadows/shadow_fixture.h"

namespace umbriel {
namespace {

class Limits : public ModuleTest {
 protected:
    struct Point {
        glm::dvec3 world, normal;
        double factor = 1.0;
    };
    // What is judged of a picture: surfaces that face the sun.
    std::vector<Point> points(PixelSize wall) {
        std::vector<Point> found;
        const auto images = drawWall(resolved(wall));
        if (images.size() < 4) {
            ADD_FAILURE() << "layers are missing";
            return found;
        }
        const glm::dvec3 eye = resolved(wall).views[0].eyeWorld;
        for (int y = 0; y < wall.height; ++y)
            for (int x = 0; x < wall.width; ++x) {
                const float* n = images[2].at(x, y);
                const float* p = images[1].at(x, y);
                const glm::dvec3 normal(n[0], n[1], n[2]);
                if (glm::dot(normal, normal) < 0.5 || glm::dot(normal, -lightDirection) < 0.1) continue;
                found.push_back({eye + glm::dvec3(p[0], p[1], p[2]) + normal * 1e-5, normal,
                                 static_cast<double>(images[3].at(x, y)[0])});
            }
        return found;
    }
    // Of the middles of kRays x kRays parts of a square around the point, `width` metres across the light and on the
    // point's own plane, the share that is lit: what a filter of this width tends to.
    double squareTruth(const Point& point, double width) const {
        const auto [u, v] = acrossLight();
        int lit = 0;
        for (int i = 0; i < kRays * kRays; ++i) {
            const glm::dvec3 step =
                width * (((i % kRays) + 0.5) / kRays - 0.5) * u + width * (((i / kRays) + 0.5) / kRays - 0.5) * v;
            const glm::dvec3 onPlane =
                step + lightDirection * (-glm::dot(step, point.normal) / glm::dot(lightDirection, point.normal));
            lit += !isDark(point.world + onPlane, -lightDirection, 1e30);
        }
        return static_cast<double>(lit) / (kRays * kRays);
    }
    // Of the parts of the sun's disc, of this angular radius, the share that is seen.
    double discTruth(const Point& point, double radius) const {
        const auto [u, v] = acrossLight();
        int lit = 0, all = 0;
        for (int i = 0; i < kRays * kRays; ++i) {
            const glm::dvec2 at(2.0 * ((i % kRays) + 0.5) / kRays - 1.0, 2.0 * ((i / kRays) + 0.5) / kRays - 1.0);
            if (glm::dot(at, at) > 1.0) continue;
            ++all;
            const glm::dvec3 toLight = glm::normalize(-lightDirection + std::tan(radius) * (at.x * u + at.y * v));
            lit += !isDark(point.world, toLight, 1e30);
        }
        return static_cast<double>(lit) / all;
    }
    template <class Truth>
    double meanError(PixelSize wall, const Truth& truth) {
        double sum = 0.0;
        const auto judged = points(wall);
        for (const Point& point : judged) sum += std::abs(point.factor - truth(point));
        return sum / static_cast<double>(std::max<std::size_t>(judged.size(), 1));
    }
    std::pair<glm::dvec3, glm::dvec3> acrossLight() const {
        const glm::dvec3 u = glm::normalize(glm::cross(lightDirection, glm::dvec3(0.3, 1, 0.2)));
        return {u, glm::cross(lightDirection, u)};
    }
    static constexpr int kRays = 10;
};

constexpr std::uint32_t kSizes[] = {512, 1024, 2048, 4096};
constexpr PixelSize kSmall{192, 120};

// Twice the texels never make it worse by more than 0.05 points. The limit that is stated is the mean over the square;
// what is left at 4096 texels are 12 x 12 samples against 10 x 10 rays.
TEST_F(Limits, AFilterOfAWidthInMetresTendsToTheMeanOverThatSquare) {
    buildTown(20.0, 40);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    look({0, 2.5, 18}, {0, 1, 0});
    const double width = 0.3;
    scene->edit(viewport)
        .set<&Viewport::shadowMode>(ShadowMode::PercentageCloser)
        .set<&Viewport::filterMetres>(static_cast<float>(width))
        .set<&Viewport::samplesPerRow>(12u);
    double last = 1.0;
    for (const std::uint32_t size : kSizes) {
        scene->edit(viewport).set<&Viewport::mapSize>(size);
        const double error = meanError(kSmall, [&](const Point& point) { return squareTruth(point, width); });
        std::printf("pcf, 0.3 m, %u texels: %.3f %% from the mean over the square\n", size, 100 * error);
        EXPECT_LE(error, last + 0.0005) << size;
        last = error;
    }
    EXPECT_LE(last, 0.01);
}

// Of the disc's truth. What is left is the model's own: it takes one distance for all blockers around a place.
TEST_F(Limits, ContactHardeningTendsToTheLightsDisc) {
    buildTown(20.0, 40);
    const double radius = 0.02;
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3}, 0.0f, static_cast<float>(radius));
    look({0, 2.5, 18}, {0, 1, 0});
    scene->edit(viewport)
        .set<&Viewport::shadowMode>(ShadowMode::PercentageCloserSoft)
        .set<&Viewport::blockerSamples>(10u)
        .set<&Viewport::filterSamples>(12u)
        .set<&Viewport::maxPenumbra>(256.0f);
    double last = 1.0;
    for (const std::uint32_t size : kSizes) {
        scene->edit(viewport).set<&Viewport::mapSize>(size);
        const double error = meanError(kSmall, [&](const Point& point) { return discTruth(point, radius); });
        std::printf("ppcf, %u texels: %.3f %% from the disc\n", size, 100 * error);
        EXPECT_LE(error, last + 0.0005) << size;
        last = error;
    }
    EXPECT_LE(last, 0.015);
}

// A filter of so many texels narrows with them, and a light without extent has none: both tend to the hard shadow.
TEST_F(Limits, FiltersOfTexelsAndLightsWithoutExtentTendToTheHardShadow) {
    buildTown();
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    look({0, 2.5, 50}, {0, 1, 0});
    for (const ShadowMode mode : {ShadowMode::PercentageCloser, ShadowMode::PercentageCloserSoft}) {
        scene->edit(viewport).set<&Viewport::shadowMode>(mode).set<&Viewport::filterWidth>(4.0f);
        const bool hard = mode == ShadowMode::PercentageCloserSoft;
        double last = 1.0;
        for (const std::uint32_t size : kSizes) {
            scene->edit(viewport).set<&Viewport::mapSize>(size);
            const Errors errors = measure();
            std::printf("%s, %u texels: %.3f %%\n", hard ? "ppcf without extent" : "pcf of 4 texels", size,
                        100 * errors.mean);
            EXPECT_LE(errors.mean, std::max(0.7 * last, 0.001)) << size;
            last = errors.mean;
        }
    }
}

// The nearest blocker is the mean one where there is only one distance; where two roofs are above each other the lower
// one casts the shadow, and the penumbra of the upper one is too wide for it.
TEST_F(Limits, TheNearestBlockerIsRightOnlyWhereNoShadowsOverlap) {
    for (const bool second : {false, true}) {
        SetUp();
        block({-20, -1, -20}, {20, 0, 20});
        block({-15, 1, -20}, {0, 1.02, 20});
        if (second) block({-15, 8, -20}, {-0.2, 8.02, 20});
        const double radius = 0.04;
        finishScene(LightPlace::Directional, {0, 0, 0}, {0, -1, 0}, 0.0f, static_cast<float>(radius));
        look({0.8, 0.9, 0}, {0, 0, 0}, 0.8);
        scene->edit(viewport)
            .set<&Viewport::shadowMode>(ShadowMode::PercentageCloserSoft)
            .set<&Viewport::mapSize>(1024u)
            .set<&Viewport::maxPenumbra>(256.0f);
        const auto truth = [&](const Point& point) { return discTruth(point, radius); };
        const double mean = meanError(kSmall, truth);
        scene->edit(viewport).set<&Viewport::nearestBlocker>(true);
        const double nearest = meanError(kSmall, truth);
        std::printf("%s: mean blocker %.3f %%, nearest %.3f %%\n", second ? "two roofs" : "one roof", 100 * mean,
                    100 * nearest);
        if (second)
            EXPECT_GT(nearest, 1.5 * mean);
        else
            EXPECT_NEAR(nearest, mean, 0.002);
    }
}

// A near plane amid the houses. Light caps must be cut by it where the surfaces are that they lie on, or these shadow
// themselves by rounding.
TEST_F(Limits, VolumesAreRightWhereTheNearPlaneCutsCastersOpen) {
    for (const ShadowMode mode : {ShadowMode::VolumeZPass, ShadowMode::VolumeZFail})
        for (const double farDistance : {0.0, 1e3})
            for (const double nearDistance : {4.0, 16.0, 23.7}) {
                SetUp();
                isOneGeometry = true;
                buildTown(30.0, 60);
                finishScene(LightPlace::Directional, {}, {0.5, -0.7, -0.3});
                look({0, 6, 26}, {0, 1, 0});
                scene->edit(Ref<PerspectiveCamera>(scene->get(viewport).camera.get().id))
                    .set<&PerspectiveCamera::nearDistance>(nearDistance)
                    .set<&PerspectiveCamera::farDistance>(farDistance);
                scene->edit(viewport).set<&Viewport::shadowMode>(mode);
                edgeMetres = 0.05;
                const Errors errors = measure();
                EXPECT_GT(errors.judged, 10000u);
                EXPECT_LT(errors.inner, 2e-4) << nearDistance << " to " << farDistance;
            }
}

// No texels: wrong is only what lies within a pixel of an edge of the true shadow.
TEST_F(Limits, VolumesAndFlattenedCastersAreRightButForAPixelAtEdges) {
    const PixelSize wall{480, 300};
    for (const LightPlace place : {LightPlace::Directional, LightPlace::Point})
        for (const ShadowMode mode :
             {ShadowMode::VolumeZPass, ShadowMode::VolumeZFail, ShadowMode::Planar, ShadowMode::PlanarStencil}) {
            SetUp();
            buildTown(30.0, 60);
            finishScene(place, {3.3, 14.1, 10.7}, {0.5, -0.7, -0.3});
            look({0, 6, 26}, {0, 1, 0});
            const bool planar = mode == ShadowMode::Planar || mode == ShadowMode::PlanarStencil;
            scene->edit(viewport)
                .set<&Viewport::shadowMode>(mode)
                .set<&Viewport::planeNormal>(glm::dvec3(0, 1, 0))
                .set<&Viewport::planeOffset>(0.0);
            const auto images = drawWall(resolved(wall));
            ASSERT_EQ(images.size(), 4u);
            const glm::dvec3 eye = resolved(wall).views[0].eyeWorld;
            // 0 lit, 1 dark, 2 not judged.
            std::vector<int> truth(static_cast<std::size_t>(wall.width * wall.height), 2);
            const auto at = [&](int x, int y) -> int& { return truth[static_cast<std::size_t>(y * wall.width + x)]; };
            for (int y = 0; y < wall.height; ++y)
                for (int x = 0; x < wall.width; ++x) {
                    const float* n = images[2].at(x, y);
                    const float* p = images[1].at(x, y);
                    const glm::dvec3 normal(n[0], n[1], n[2]);
                    if (glm::dot(normal, normal) < 0.5) continue;
                    const glm::dvec3 point = eye + glm::dvec3(p[0], p[1], p[2]) + normal * 2e-5;
                    if (planar && std::abs(point.y) > 1e-3) continue;
                    const bool sun = place == LightPlace::Directional;
                    const double reach = sun ? 1e30 : glm::distance(lightPosition, point);
                    const glm::dvec3 toLight = sun ? -lightDirection : (lightPosition - point) / reach;
                    if (glm::dot(normal, toLight) >= 0.1) at(x, y) = isDark(point, toLight, reach) ? 1 : 0;
                }
            std::size_t judged = 0, dark = 0, wrong = 0, beyond = 0;
            for (int y = 1; y + 1 < wall.height; ++y)
                for (int x = 1; x + 1 < wall.width; ++x) {
                    const int own = at(x, y);
                    if (own == 2) continue;
                    ++judged;
                    dark += own == 1;
                    if ((images[3].at(x, y)[0] < 0.5f) == (own == 1)) continue;
                    ++wrong;
                    bool edge = false;
                    for (int k = 0; k < 9; ++k) edge = edge || at(x + k % 3 - 1, y + k / 3 - 1) != own;
                    beyond += !edge;
                }
            std::printf("module %d, %s: %zu of %zu wrong, %zu beyond a pixel\n", static_cast<int>(mode),
                        place == LightPlace::Directional ? "sun" : "lamp", wrong, judged, beyond);
            EXPECT_GT(judged, 20000u);
            EXPECT_GT(dark, 1000u);
            EXPECT_EQ(beyond, 0u);
            // Where a ray of double precision and an edge of float ones part, on a pixel's middle.
            EXPECT_LE(wrong, judged / 10000);
        }
}

class EveryScale : public Limits {
 protected:
    // 1e-3 to 1e4, and a million metres away. A picture of millimetres there has no doubles enough.
    template <class Each>
    void everywhere(const Each& each) {
        for (const double size : {1e-3, 1.0, 1e4})
            for (const double away : {0.0, 1e6}) {
                if (away > 0.0 && size < 1.0) continue;
                SetUp();
                scale = size;
                offset = glm::dvec3(away, -away, away);
                buildTown(20.0, 40);
                each();
            }
    }
    void holds(ShadowMode mode) {
        const Errors errors = measure();
        std::printf("module %d, scale %g, %g m away: %.3f %%, beyond edges %.4f %%\n", static_cast<int>(mode), scale,
                    offset.x, 100 * errors.error, 100 * errors.inner);
        EXPECT_GT(errors.judged, 20000u);
        EXPECT_GT(errors.dark, 1000u);
        EXPECT_LT(errors.inner, 0.001);
    }
};

TEST_F(EveryScale, FiltersKeepTheirDefaults) {
    for (const ShadowMode mode : {ShadowMode::PercentageCloser, ShadowMode::PercentageCloserSoft})
        everywhere([&] {
            finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
            look({0, 2.5, 18}, {0, 1, 0});
            scene->edit(viewport)
                .set<&Viewport::shadowMode>(mode)
                .set<&Viewport::mapSize>(2048u)
                .set<&Viewport::filterWidth>(4.0f);
            const double reach = mode == ShadowMode::PercentageCloser ? 1.5 + 0.5 * 4.0 : 1.5;
            edgeMetres = reach * resolved({480, 300}).views[0].fits.at(0).texelSize;
            holds(mode);
        });
}

TEST_F(EveryScale, MapsAroundALampKeepTheirDefaults) {
    for (const ShadowMode mode : {ShadowMode::Cube, ShadowMode::DualParaboloid})
        everywhere([&] {
            finishScene(LightPlace::Point, {3.3, 6.1, 4.7}, {0, -1, 0});
            look({0, 6, 18}, {0, 1, 0});
            scene->edit(viewport).set<&Viewport::shadowMode>(mode).set<&Viewport::mapSize>(2048u);
            // Radians: of a face's middle, of a hemisphere's, where texels are largest; with the border.
            edgeAngle = 1.5 * (mode == ShadowMode::Cube ? 2.02 : 4.04) / 2048.0;
            holds(mode);
        });
}

TEST_F(EveryScale, VolumesKeepTheirDefaults) {
    for (const ShadowMode mode : {ShadowMode::VolumeZPass, ShadowMode::VolumeZFail})
        for (const LightPlace place : {LightPlace::Directional, LightPlace::Point})
            everywhere([&] {
                finishScene(place, {3.3, 6.1, 4.7}, {0.5, -0.7, -0.3});
                look({0, 6, 18}, {0, 1, 0});
                scene->edit(viewport).set<&Viewport::shadowMode>(mode);
                edgeMetres = 0.05 * scale;  // a pixel is 5 cm wide at 24 m, the town's farther end
                holds(mode);
            });
}

}  // namespace
}  // namespace umbriel
