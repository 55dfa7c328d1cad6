#include "tests/golden/draw_fixture.h"

namespace umbriel {
namespace {

constexpr std::uint32_t kFactors =
    static_cast<std::uint32_t>(Layer::Colour) | static_cast<std::uint32_t>(Layer::LightFactors);

class ShadowTest : public DrawTest {};

// A plate of 1 m at height 1 over the plane z = 0, a light at 45 degrees from -x: its shadow lies 1 m further in +x.
TEST_F(ShadowTest, AShadowLiesWhereGeometrySaysToHalfATexel) {
    const auto light = scene->create<DirectionalLight>();
    const glm::vec3 travels(1, 0, -1);
    const Ref<Node> below = lit(root, light, travels);
    node(below, geometry(gridMesh(8.0f, 8), material({1, 1, 1, 1})));
    Mesh plate = gridMesh(0.5f);
    node(placed(below, {-2, 0, 1}), geometry(plate, material({1, 1, 1, 1})));
    View view = flatView(4.0, {400, 300});                                    // 1 cm pixels
    const ShadowFit fit = fitSphere(light.id, travels, {0, 0, 0}, 12, 2048);  // 12 mm texels
    view.fits = {fit};
    const auto images = drawWall(wallViews(view, TileMode::Exact, 1, kFactors));
    ASSERT_EQ(images.size(), 2u);
    // The texel is stretched by 1/cos(45 degrees) along x; normal offset moves the lookup by less than its width.
    const double allowed = 1.5 * fit.texelSize * std::sqrt(2.0) + 0.01;
    std::size_t wrong = 0;
    for (int y = 0; y < 300; ++y)
        for (int x = 0; x < 400; ++x) {
            const double px = (x + 0.5) / 100 - 2;
            const double py = (y + 0.5) / 100 - 1.5;
            if (px < -1.5) continue;                   // the plate itself covers the view there
            const double dx = std::abs(px + 1) - 0.5;  // distance outside of the shadow's square
            const double dy = std::abs(py) - 0.5;
            const double distance = std::max(dx, dy);
            if (std::abs(distance) < allowed) continue;
            wrong += (images[1].at(x, y)[0] > 0.5f) != (distance > 0.0);
        }
    EXPECT_EQ(wrong, 0u);
}

// A tilted plane alone must be lit everywhere, at every angle.
TEST_F(ShadowTest, ALitPlaneHasNoAcne) {
    for (const double degrees : {0.0, 10.0, 45.0, 80.0, 87.0}) {
        for (const double around : {0.0, 0.7, 2.0}) {
            SetUp();
            const auto light = scene->create<DirectionalLight>();
            const double angle = degrees / 57.29577951;
            const glm::vec3 travels(std::sin(angle) * std::cos(around), std::sin(angle) * std::sin(around),
                                    -std::cos(angle));
            node(lit(root, light, travels), geometry(gridMesh(6.0f, 3), material({1, 1, 1, 1})));
            View view = lookAt({1, -3, 4}, {0, 0, 0}, 0.9, {160, 120}, {0, 0, 1});
            view.fits = {fitSphere(light.id, travels, {0, 0, 0}, 9, 256)};
            const auto images =
                drawWall(wallViews(view, TileMode::Exact, 1, kFactors | static_cast<std::uint32_t>(Layer::Depth)));
            ASSERT_EQ(images.size(), 3u);
            std::size_t dark = 0, seen = 0;
            for (int y = 0; y < 120; ++y)
                for (int x = 0; x < 160; ++x)
                    if (images[1].at(x, y)[0] > 0.0f) {
                        ++seen;
                        dark += images[2].at(x, y)[0] < 1.0f;
                    }
            EXPECT_GT(seen, 5000u);
            EXPECT_EQ(dark, 0u) << degrees << " degrees, around " << around;
        }
    }
}

TEST_F(ShadowTest, ASpotLightCastsAPerspectiveShadow) {
    const auto light = scene->create<SpotLight>();
    const Ref<Node> beacon = placed(root, {0, 0, 4});
    scene->edit(light)
        .set<&SpotLight::intensity>(glm::vec3(50.0f))
        .set<&SpotLight::beacon>(beacon)
        .set<&SpotLight::innerAngle>(0.7f)
        .set<&SpotLight::outerAngle>(0.78f);
    const Ref<Node> below = node(root, light);
    node(below, geometry(gridMesh(8.0f, 8), material({1, 1, 1, 1})));
    node(placed(below, {0, 0, 2}), geometry(gridMesh(0.25f), material({1, 1, 1, 1})));
    // Seen from below the plate: only the ground.
    View view = lookAt({3, 0, 1.5}, {0, 0, 0}, 1.0, {200, 160}, {0, 0, 1});
    ShadowFit fit;
    fit.light = light.id;
    fit.mode = ShadowMode::Standard;
    fit.mapSize = 512;
    fit.perspective = true;
    const double f = 1.0 / std::tan(0.8), near = 0.1;
    glm::dmat4 clipFromLight(0.0);
    clipFromLight[0][0] = clipFromLight[1][1] = f;
    clipFromLight[2][3] = -1.0;
    clipFromLight[3][2] = near;
    fit.positionWorld = {0, 0, 4};
    fit.clipFromWorld = clipFromLight * glm::translate(glm::dmat4(1.0), -fit.positionWorld);
    fit.texelSize = 2 / f / 512;
    fit.normalOffset = 0.5f;
    view.fits = {fit};
    const auto images =
        drawWall(wallViews(view, TileMode::Exact, 1, kFactors | static_cast<std::uint32_t>(Layer::Position)));
    ASSERT_EQ(images.size(), 3u);
    // The shadow of a 0.5 m plate halfway is 1 m wide. Texels at 4 m: 16 mm.
    std::size_t wrong = 0, inside = 0;
    for (int y = 0; y < 160; ++y)
        for (int x = 0; x < 200; ++x) {
            const float* position = images[1].at(x, y);
            const glm::dvec3 world = view.eyeWorld + glm::dvec3(position[0], position[1], position[2]);
            if (std::abs(world.z) > 1e-3 || position[2] == 0.0f) continue;
            const double distance = std::max(std::abs(world.x), std::abs(world.y)) - 0.5;
            if (std::abs(distance) < 0.03) continue;
            inside += distance < 0;
            wrong += (images[2].at(x, y)[0] > 0.5f) != (distance > 0);
        }
    EXPECT_GT(inside, 500u);
    EXPECT_EQ(wrong, 0u);
}

TEST_F(ShadowTest, AShadowTakesOnlyItsOwnLight) {
    const auto sun = scene->create<DirectionalLight>();
    const glm::vec3 travels(0, 0, -1);
    const Ref<Node> below = lit(root, sun, travels, glm::vec3(3.14159265f));
    const auto second = scene->create<DirectionalLight>();
    scene->edit(second).set<&DirectionalLight::castsShadow>(false);
    const Ref<Node> both = lit(below, second, travels, glm::vec3(0.5f * 3.14159265f));
    const auto ambient = scene->create<AmbientLight>();
    scene->edit(ambient).set<&AmbientLight::radiance>(glm::vec3(0.125f));
    const Ref<Node> all = node(both, ambient);
    const auto grey = material({0.5f, 0.5f, 0.5f, 1});
    scene->edit(grey).set<&Material::ambient>(glm::vec3(1.0f)).set<&Material::emission>(glm::vec3(0.0625f));
    node(all, geometry(gridMesh(4.0f), grey));
    // A roof that the viewer does not see: single-sided, from above its back... it faces down.
    node(placed(all, {0, 0, 2}, glm::mat3(1, 0, 0, 0, -1, 0, 0, 0, -1)), geometry(gridMesh(1.0f), grey));
    View view = flatView(4.0, {64, 48});
    view.fits = {fitSphere(sun.id, travels, {0, 0, 0}, 6, 256)};
    const WallImage image = drawColour(wallViews(view));
    ASSERT_FALSE(image.values.empty());
    EXPECT_NEAR(image.at(4, 4)[0], 0.5f + 0.25f + 0.125f + 0.0625f, 1e-5f);
    EXPECT_NEAR(image.at(32, 24)[0], 0.25f + 0.125f + 0.0625f, 1e-5f);
    scene->edit(viewport).set<&Viewport::shadowColor>(glm::vec3(0.5f));
    EXPECT_NEAR(drawColour(wallViews(view)).at(32, 24)[0], 0.25f + 0.25f + 0.125f + 0.0625f, 1e-5f);
    scene->edit(viewport).set<&Viewport::shadowOn>(false);
    EXPECT_NEAR(drawColour(wallViews(view)).at(32, 24)[0], 0.5f + 0.25f + 0.125f + 0.0625f, 1e-5f);
    EXPECT_EQ(renderer->explain().find("shadow"), std::string::npos);
}

TEST_F(ShadowTest, ExcludedNodesAndHolesCastNothing) {
    const auto sun = scene->create<DirectionalLight>();
    const glm::vec3 travels(0, 0, -1);
    const Ref<Node> below = lit(root, sun, travels, glm::vec3(3.14159265f));
    node(below, geometry(gridMesh(4.0f), material({1, 1, 1, 1})));
    const auto cut = material({1, 1, 1, 1});
    scene->edit(cut).set<&Material::alphaMode>(AlphaMode::Mask).set<&Material::alphaCutoff>(0.6f);
    Mesh faded = gridMesh(1.0f);
    faded.colours = {{1, 1, 1, 0.2f}, {1, 1, 1, 1.0f}, {1, 1, 1, 0.2f}, {1, 1, 1, 1.0f}};  // a hole where x < 0
    const glm::mat3 down(1, 0, 0, 0, -1, 0, 0, 0, -1);
    const Ref<Node> roof = placed(below, {0, 0, 2}, down);
    node(roof, geometry(faded, cut));
    View view = flatView(4.0, {64, 48});
    view.fits = {fitSphere(sun.id, travels, {0, 0, 0}, 6, 256)};
    WallImage image = drawColour(wallViews(view));
    ASSERT_FALSE(image.values.empty());
    EXPECT_NEAR(image.at(22, 24)[0], 1.0f, 1e-5f);
    EXPECT_EQ(image.at(42, 24)[0], 0.0f);
    scene->edit(viewport).append<&Viewport::excludeNodes>(roof);
    EXPECT_NEAR(drawColour(wallViews(view)).at(42, 24)[0], 1.0f, 1e-5f);
}

TEST_F(ShadowTest, LightNodesChooseTheLights) {
    const auto a = scene->create<DirectionalLight>();
    const Ref<Node> nodeA = lit(root, a, {0, 0, -1}, {3.14159265f, 0, 0});
    const auto b = scene->create<DirectionalLight>();
    const Ref<Node> nodeB = lit(nodeA, b, {0, 0, -1}, {0, 3.14159265f, 0});
    node(nodeB, geometry(gridMesh(4.0f), material({1, 1, 1, 1})));
    scene->edit(viewport).append<&Viewport::lightNodes>(nodeB);
    const WallImage image = drawColour(wallViews(flatView(4.0, {64, 48})));
    ASSERT_FALSE(image.values.empty());
    EXPECT_EQ(image.at(32, 24)[0], 0.0f);
    EXPECT_NEAR(image.at(32, 24)[1], 1.0f, 1e-5f);
}

}  // namespace
}  // namespace umbriel
