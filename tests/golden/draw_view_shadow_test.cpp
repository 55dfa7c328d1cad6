#include <algorithm>

#include "tests/golden/draw_fixture.h"

namespace umbriel {
namespace {

constexpr std::uint32_t kFactors =
    static_cast<std::uint32_t>(Layer::Colour) | static_cast<std::uint32_t>(Layer::LightFactors);
constexpr ShadowMode kVolumes[] = {ShadowMode::VolumeZPass, ShadowMode::VolumeZFail};
constexpr ShadowMode kHard[] = {ShadowMode::VolumeZPass, ShadowMode::VolumeZFail, ShadowMode::Planar,
                                ShadowMode::PlanarStencil};

// Shadows that are made in the view: volumes, flattened casters, blobs.
class ViewShadowTest : public DrawTest {
 protected:
    ShadowFit fitOf(ContainerId light, ShadowMode mode, const glm::dvec3& travels) const {
        ShadowFit fit;
        fit.light = light;
        fit.mode = mode;
        fit.worldFromLight = glm::dmat3(lookingAlong(glm::vec3(travels)));
        fit.planeWorld = {0, 0, 1, 0};
        return fit;
    }
    ShadowFit fitAt(ContainerId light, ShadowMode mode, const glm::dvec3& position) const {
        ShadowFit fit = fitOf(light, mode, {0, 0, -1});
        fit.perspective = true;
        fit.positionWorld = position;
        return fit;
    }
    Ref<Node> pointLit(Ref<PointLight>& light, const glm::dvec3& position) {
        light = scene->create<PointLight>();
        const Ref<Node> beacon = placed(root, position);
        scene->edit(light).set<&PointLight::intensity>(glm::vec3(50.0f)).set<&PointLight::beacon>(beacon);
        return node(root, light);
    }
    // Pixels of a flat view of 4 x 3 m, 1 cm each, that are dark where nothing keeps the light away or the other way
    // round; those nearer than a pixel to the edge of the shadow's rectangle are not judged.
    static std::size_t wrongPixels(const WallImage& factors, glm::dvec2 lower, glm::dvec2 upper, double from) {
        std::size_t wrong = 0;
        for (int y = 0; y < 300; ++y)
            for (int x = 0; x < 400; ++x) {
                const glm::dvec2 p((x + 0.5) / 100 - 2, (y + 0.5) / 100 - 1.5);
                if (p.x < from) continue;
                const double outside = std::max({lower.x - p.x, p.x - upper.x, lower.y - p.y, p.y - upper.y});
                if (std::abs(outside) < 0.011) continue;
                wrong += (factors.at(x, y)[0] > 0.5f) != (outside > 0.0);
            }
        return wrong;
    }
};

TEST_F(ViewShadowTest, AShadowLiesWhereGeometrySaysToAPixel) {
    for (const ShadowMode mode : kHard)
        for (const std::uint32_t samples : {1u, 4u}) {
            SetUp();
            const auto light = scene->create<DirectionalLight>();
            const glm::vec3 travels(1, 0, -1);
            const Ref<Node> below = lit(root, light, travels);
            node(below, geometry(gridMesh(8.0f, 8), material({1, 1, 1, 1})));
            node(placed(below, {-2, 0, 1}), geometry(gridMesh(0.5f), material({1, 1, 1, 1})));
            View view = flatView(4.0, {400, 300});
            view.fits = {fitOf(light.id, mode, travels)};
            const auto images = drawWall(wallViews(view, TileMode::Exact, samples, kFactors));
            ASSERT_EQ(images.size(), 2u);
            EXPECT_EQ(wrongPixels(images[1], {-1.5, -0.5}, {-0.5, 0.5}, -1.4), 0u)
                << static_cast<int>(mode) << ", " << samples << " samples";
        }
}

// A plate that shows its back, which is not drawn: the eye looks through it into its shadow, and not past its edges.
TEST_F(ViewShadowTest, ACasterThatIsNotSeenFromBehindShadowsWhatIsSeenThroughIt) {
    for (const ShadowMode mode : kVolumes) {
        SetUp();
        const auto light = scene->create<DirectionalLight>();
        const glm::vec3 travels(1, 0, -1);
        const Ref<Node> below = lit(root, light, travels);
        const auto oneSided = material({1, 1, 1, 1});
        scene->edit(oneSided).set<&Material::doubleSided>(false);
        node(below, geometry(gridMesh(8.0f, 8), oneSided));
        const glm::mat3 turned(1, 0, 0, 0, -1, 0, 0, 0, -1);
        node(placed(below, {-0.5, 0, 0.3}, turned), geometry(gridMesh(0.5f), oneSided));
        View view = flatView(4.0, {400, 300});
        view.fits = {fitOf(light.id, mode, travels)};
        const auto images = drawWall(wallViews(view, TileMode::Exact, 1, kFactors));
        ASSERT_EQ(images.size(), 2u);
        EXPECT_EQ(wrongPixels(images[1], {-0.7, -0.5}, {0.3, 0.5}, -2.0), 0u) << static_cast<int>(mode);
    }
}

// A lamp 4 m above the ground, a plate of 0.5 m at 2 m: its shadow is twice as large.
TEST_F(ViewShadowTest, ALampsShadowGrowsWithTheDistance) {
    for (const ShadowMode mode : kHard) {
        SetUp();
        Ref<PointLight> light;
        const Ref<Node> below = pointLit(light, {-3, 0, 4});
        node(below, geometry(gridMesh(8.0f, 8), material({1, 1, 1, 1})));
        node(placed(below, {-1.5, 0, 2}), geometry(gridMesh(0.25f), material({1, 1, 1, 1})));
        View view = flatView(4.0, {400, 300});
        view.fits = {fitAt(light.id, mode, {-3, 0, 4})};
        const auto images = drawWall(wallViews(view, TileMode::Exact, 1, kFactors));
        ASSERT_EQ(images.size(), 2u);
        EXPECT_EQ(wrongPixels(images[1], {-0.5, -0.5}, {0.5, 0.5}, -1.2), 0u) << static_cast<int>(mode);
    }
}

// The eye hovers in the shadow of a box and looks at the ground, whose border between dark and lit crosses the picture.
TEST_F(ViewShadowTest, AnEyeInsideAVolumeSeesWhatIsDark) {
    for (const ShadowMode mode : kVolumes) {
        SetUp();
        const auto light = scene->create<DirectionalLight>();
        const glm::vec3 travels(0, 0, -1);
        const Ref<Node> below = lit(root, light, travels);
        node(below, geometry(gridMesh(20.0f, 8), material({1, 1, 1, 1})));
        node(placed(below, {0, 0, 5}), geometry(boxMesh(glm::vec3(1)), material({1, 1, 1, 1})));
        View view = lookAt({0, 0, 2}, {0, 3, 0}, 1.2, {200, 150}, {0, 0, 1});
        view.fits = {fitOf(light.id, mode, travels)};
        const auto images =
            drawWall(wallViews(view, TileMode::Exact, 1, kFactors | static_cast<std::uint32_t>(Layer::Position)));
        ASSERT_EQ(images.size(), 3u);
        std::size_t wrong = 0, dark = 0, seen = 0;
        for (int y = 0; y < 150; ++y)
            for (int x = 0; x < 200; ++x) {
                if (images[1].at(x, y)[2] > -1.9f) continue;  // the ground is 2 m below the eye
                const double outside = std::max(std::abs(images[1].at(x, y)[0]), std::abs(images[1].at(x, y)[1])) - 1.0;
                if (std::abs(outside) < 0.05) continue;
                ++seen;
                dark += outside < 0.0;
                wrong += (images[2].at(x, y)[0] > 0.5f) != (outside > 0.0);
            }
        EXPECT_GT(dark, 500u);
        EXPECT_GT(seen - dark, 5000u);
        EXPECT_EQ(wrong, 0u) << static_cast<int>(mode);
    }
}

// More volumes over each other than an 8-bit stencil can count.
TEST_F(ViewShadowTest, ThreeHundredOverlapsAreDark) {
    for (const ShadowMode mode : kVolumes) {
        SetUp();
        const auto light = scene->create<DirectionalLight>();
        const glm::vec3 travels(1, 0, -1);
        const Ref<Node> below = lit(root, light, travels);
        node(below, geometry(gridMesh(8.0f, 8), material({1, 1, 1, 1})));
        const auto plate = geometry(gridMesh(0.5f), material({1, 1, 1, 1}));
        // Each as if moved along the light, so that all cast the same shadow.
        for (int i = 0; i < 256; ++i) {
            const double up = 1.0 + 0.004 * i;
            node(placed(below, {-1 - up, 0, up}), plate);
        }
        View view = flatView(4.0, {400, 300});
        view.fits = {fitOf(light.id, mode, travels)};
        const auto images = drawWall(wallViews(view, TileMode::Exact, 1, kFactors));
        EXPECT_EQ(wrongPixels(images[1], {-1.5, -0.5}, {-0.5, 0.5}, -1.4), 0u) << static_cast<int>(mode);
    }
}

TEST_F(ViewShadowTest, TilesAgreeToTheBit) {
    for (const ShadowMode mode : {ShadowMode::VolumeZPass, ShadowMode::VolumeZFail, ShadowMode::Planar,
                                  ShadowMode::PlanarStencil, ShadowMode::Blob})
        for (const std::uint32_t samples : {1u, 4u}) {
            SetUp();
            Ref<PointLight> lamp;
            const Ref<Node> below = pointLit(lamp, {2, -1, 4});
            node(below, geometry(gridMesh(8.0f, 8), material({1, 1, 1, 1})));
            for (int i = 0; i < 5; ++i)
                node(placed(below, {0.8 * i - 1.6, 0.3 * i - 0.5, 0.6}, glm::mat3(lookingAlong({1, 0.3f * i, 0.5f}))),
                     geometry(boxMesh({0.3f, 0.2f, 0.4f}), material({1, 0.5f, 0.3f, 1})));
            View view = lookAt({1, -5, 3}, {0, 0, 0.3}, 0.9, {173, 117}, {0, 0, 1});
            view.fits = {fitAt(lamp.id, mode, {2, -1, 4})};
            const WallImage whole = drawColour(wallViews(view, TileMode::Exact, samples));
            view.fits.clear();
            EXPECT_NE(whole.values, drawColour(wallViews(view, TileMode::Exact, samples)).values)
                << "there is a shadow";
            view.fits = {fitAt(lamp.id, mode, {2, -1, 4})};
            for (const TileMode tiles : {TileMode::Exact, TileMode::Offset}) {
                const WallImage one = tiles == TileMode::Exact ? whole : drawColour(wallViews(view, tiles, samples));
                for (const int side : {2, 4})
                    EXPECT_EQ(one.values, drawColour(wallViews(view, tiles, samples), side, side).values)
                        << static_cast<int>(mode) << " " << side << " " << samples;
            }
        }
}

// 2 m of blob under a box of 2 sqrt(3) m, seen from above through a box that is cut away: dark in the middle, lit
// outside.
TEST_F(ViewShadowTest, ABlobIsDarkUnderItsObjectAndFadesOut) {
    const auto light = scene->create<DirectionalLight>();
    const glm::vec3 travels(1, 0, -1);
    const Ref<Node> below = lit(root, light, travels);
    node(below, geometry(gridMesh(8.0f, 8), material({1, 1, 1, 1})));
    node(placed(below, {-2, 0, 2}), geometry(boxMesh(glm::vec3(0.25f)), material({1, 1, 1, 1})));
    View view = flatView(4.0, {400, 300});
    view.fits = {fitOf(light.id, ShadowMode::Blob, travels)};
    const auto images = drawWall(wallViews(view, TileMode::Exact, 1, kFactors));
    // The axis meets the ground in the middle; across the light the box reaches sqrt(2 0.25^2 + 0.25^2) at its corners.
    const double radius = 0.25 * std::sqrt(3.0);
    const auto factor = [&](double x, double y) {
        return images[1].at(static_cast<int>((x + 2) * 100), static_cast<int>((y + 1.5) * 100))[0];
    };
    EXPECT_EQ(factor(0, 0), 0.0f);
    EXPECT_EQ(factor(0, 0.4 * radius), 0.0f);
    EXPECT_NEAR(factor(0, 0.75 * radius), 0.5, 0.1) << "half way through the soft rim; a pixel is 0.05 of it";
    EXPECT_EQ(factor(0, 1.1 * radius), 1.0f);
    EXPECT_EQ(factor(0.4 * radius * std::sqrt(2.0), 0), 0.0f) << "drawn out where the light comes in at 45 degrees";
    EXPECT_EQ(factor(1.1 * radius * std::sqrt(2.0), 0), 1.0f);
}

// A pane of glass hovers over the ground, before one half of the shadow of a plate and the lit ground beside it. What
// the glass shows is glass in the light or in the shadow, whatever lies behind it: as drawn with maps.
TEST_F(ViewShadowTest, GlassIsAsDarkAsItsOwnPlace) {
    // Light falls straight down; the plate is to the left, above all. Panes: one in its shadow, one beside it.
    const auto pictureOf = [&](ShadowMode mode, std::uint32_t samples, TileMode tiles, int grid, bool below) {
        SetUp();
        const auto light = scene->create<DirectionalLight>();
        const glm::vec3 travels(1, 0, -1);
        const Ref<Node> all = lit(root, light, travels);
        node(all, geometry(gridMesh(8.0f, 8), material({0.5f, 0.5f, 0.5f, 1}, ReflectionModel::Lambert)));
        // Casts onto x in [-1.5, -0.5] of the ground, [-2, -1] at 0.5 m, y in [-0.5, 0.5].
        node(placed(all, {-4, 0, 3}), geometry(gridMesh(0.5f), material({1, 1, 1, 1})));
        const Ref<Material> glass = material({1.0f, 0.2f, 0.1f, 0.5f}, ReflectionModel::Lambert);
        scene->edit(glass).set<&Material::alphaMode>(AlphaMode::Blend).set<&Material::doubleSided>(true);
        if (below) node(placed(all, {0.5, 0, 0.25}), geometry(gridMesh(0.4f), glass));
        const Ref<Node> pane = node(placed(all, {-1, 0, 0.5}), geometry(gridMesh(0.9f), glass));
        View view = flatView(4.0, {200, 150});
        if (mode == ShadowMode::Standard)
            view.fits = {fitSphere(light.id, travels, {0, 0, 0}, 8, 2048)};
        else
            view.fits = {fitOf(light.id, mode, travels)};
        static_cast<void>(pane);
        return drawWall(wallViews(view, tiles, samples, kFactors), grid, grid);
    };
    const auto expectSame = [](const WallImage& one, const WallImage& other, const char* what) {
        std::size_t wrong = 0;
        for (int y = 0; y < 150; ++y)
            for (int x = 0; x < 200; ++x) {
                const double px = (x + 0.5) / 50 - 2, py = (y + 0.5) / 50 - 1.5;
                // Two pixels around edges of shadows, on the glass and behind it, and of the panes are not judged.
                bool edge = false;
                for (const double at : {-2.0, -1.5, -1.0, -0.5, -1.9, -0.1, 0.1, 0.9}) edge |= std::abs(px - at) < 0.06;
                for (const double at : {-0.9, -0.5, -0.4, 0.4, 0.5, 0.9}) edge |= std::abs(py - at) < 0.06;
                if (edge) continue;
                for (std::uint32_t c = 0; c < std::min(one.channels, 3u); ++c)
                    wrong += std::abs(one.at(x, y)[c] - other.at(x, y)[c]) > 1e-4f;
            }
        EXPECT_EQ(wrong, 0u) << what;
    };
    const auto maps = pictureOf(ShadowMode::Standard, 1, TileMode::Exact, 1, true);
    ASSERT_EQ(maps.size(), 2u);
    // Glass in the shadow before lit ground, glass in the light before dark ground.
    EXPECT_LT(maps[0].at(15, 75)[0], maps[0].at(15, 40)[0]);
    for (const ShadowMode mode : kVolumes)
        for (const std::uint32_t samples : {1u, 4u}) {
            const auto images = pictureOf(mode, samples, TileMode::Exact, 1, true);
            expectSame(images[0], maps[0], "colour");
            expectSame(images[1], maps[1], "light factors of what is opaque");
            EXPECT_EQ(differingPixels(images[0], pictureOf(mode, samples, TileMode::Exact, 4, true)[0]), 0u);
            const WallImage offset = pictureOf(mode, samples, TileMode::Offset, 1, true)[0];
            EXPECT_EQ(differingPixels(offset, pictureOf(mode, samples, TileMode::Offset, 3, true)[0]), 0u);
        }
    // Flattened casters lie on the ground: glass above it has no shadow, and shows that of the ground through it.
    for (const ShadowMode mode : {ShadowMode::PlanarStencil, ShadowMode::Planar}) {
        const auto images = pictureOf(mode, 4, TileMode::Exact, 1, false);
        EXPECT_NEAR(images[0].at(15, 75)[0], images[0].at(15, 40)[0], 1e-6f) << "before lit ground";
        EXPECT_LT(images[0].at(50, 75)[0], images[0].at(50, 40)[0] - 0.05f) << "before dark ground";
        EXPECT_GT(images[0].at(50, 75)[0], 0.1f) << "the glass itself is lit";
    }
}

// The darkness that glass is given is taken back before light factors are drawn: filtered as it was.
TEST_F(ViewShadowTest, GlassLeavesTheFilteredFactorsOfWhatIsOpaque) {
    for (const std::uint32_t samples : {1u, 4u}) {
        WallImage factors[2];
        for (const bool withGlass : {false, true}) {
            SetUp();
            scene->edit(viewport).set<&Viewport::gauss>(5.0f);
            const auto light = scene->create<DirectionalLight>();
            const Ref<Node> all = lit(root, light, {1, 0, -1});
            node(all, geometry(gridMesh(8.0f, 8), material({1, 1, 1, 1})));
            node(placed(all, {-3, 0, 3}), geometry(gridMesh(0.5f), material({1, 1, 1, 1})));
            const Ref<Material> glass = material({1.0f, 0.2f, 0.1f, 0.5f});
            scene->edit(glass).set<&Material::alphaMode>(AlphaMode::Blend);
            if (withGlass) node(placed(all, {0, 0, 0.5}), geometry(gridMesh(0.9f), glass));
            View view = flatView(4.0, {80, 60});
            view.fits = {fitOf(light.id, ShadowMode::VolumeZFail, {1, 0, -1})};
            factors[withGlass] = drawWall(wallViews(view, TileMode::Exact, samples, kFactors), 2, 1).at(1);
        }
        std::size_t soft = 0;
        for (const float factor : factors[0].values) soft += factor > 0.01f && factor < 0.99f;
        EXPECT_GT(soft, 100u) << "the filter is on";
        EXPECT_EQ(differingPixels(factors[0], factors[1]), 0u);
    }
}

// Light falls through the holes of a texture: exactly where flattened casters and maps say so.
TEST_F(ViewShadowTest, FlattenedCastersHaveTheirHoles) {
    std::vector<WallImage> factors;
    for (const ShadowMode mode : {ShadowMode::Standard, ShadowMode::Planar, ShadowMode::PlanarStencil}) {
        SetUp();
        const auto light = scene->create<DirectionalLight>();
        const glm::vec3 travels(1, 0, -1);
        const Ref<Node> below = lit(root, light, travels);
        node(below, geometry(gridMesh(8.0f, 8), material({1, 1, 1, 1})));
        const Ref<Material> lattice = material({1, 1, 1, 1});
        const Ref<Texture> holes =
            checkerTexture(2, {255, 255, 255, 255, 255, 255, 255, 0, 255, 255, 255, 0, 255, 255, 255, 255});
        scene->edit(holes).set<&Texture::magFilter>(FilterMode::Nearest).set<&Texture::mipMode>(MipMode::None);
        scene->edit(lattice).set<&Material::alphaMode>(AlphaMode::Mask).set<&Material::baseColourTexture>(holes);
        node(placed(below, {-3, 0, 2}), geometry(gridMesh(0.8f), lattice));
        View view = flatView(4.0, {200, 150});
        if (mode == ShadowMode::Standard)
            view.fits = {fitSphere(light.id, travels, {0, 0, 0}, 8, 2048)};
        else
            view.fits = {fitOf(light.id, mode, travels)};
        factors.push_back(drawWall(wallViews(view, TileMode::Exact, 1, kFactors)).at(1));
    }
    std::size_t dark = 0;
    for (std::size_t mode = 1; mode < factors.size(); ++mode) {
        std::size_t wrong = 0;
        for (int y = 0; y < 150; ++y)
            for (int x = 0; x < 200; ++x) {
                const double px = (x + 0.5) / 50 - 2, py = (y + 0.5) / 50 - 1.5;
                bool edge = false;
                for (const double at : {-1.8, -1.0, -0.2}) edge |= std::abs(px - at) < 0.06;
                for (const double at : {-0.8, 0.0, 0.8}) edge |= std::abs(py - at) < 0.06;
                if (edge) continue;
                dark += factors[0].at(x, y)[0] < 0.5f;
                wrong += (factors[0].at(x, y)[0] < 0.5f) != (factors[mode].at(x, y)[0] < 0.5f);
            }
        EXPECT_EQ(wrong, 0u);
    }
    EXPECT_GT(dark, 4000u);  // half of 80 x 80 pixels, twice, without their edges
}

TEST_F(ViewShadowTest, AWarningNamesOnceWhatVolumesTakeForWhole) {
    const auto light = scene->create<DirectionalLight>();
    const Ref<Node> below = lit(root, light, {1, 0, -1});
    const Ref<Material> lattice = material({1, 1, 1, 1});
    scene->edit(lattice)
        .set<&Material::alphaMode>(AlphaMode::Mask)
        .set<&Material::baseColourTexture>(checkerTexture(8));
    scene->edit(node(below, geometry(gridMesh(0.5f), lattice))).set<&Node::name>(std::string("lattice"));
    View view = flatView(4.0, {40, 30});
    view.fits = {fitOf(light.id, ShadowMode::VolumeZFail, {1, 0, -1})};
    testing::internal::CaptureStderr();
    drawColour(wallViews(view), 2, 2);
    drawColour(wallViews(view));
    const std::string said = testing::internal::GetCapturedStderr();
    const auto at = said.find("'lattice' for whole");
    ASSERT_NE(at, std::string::npos) << said;
    EXPECT_EQ(said.find("for whole", at + 20), std::string::npos) << said;
}

// Nothing is drawn in the view when the mode works with maps, and no map when it works in the view.
TEST_F(ViewShadowTest, OnlyWhatIsNeededIsPlanned) {
    const auto light = scene->create<DirectionalLight>();
    const Ref<Node> below = lit(root, light, {1, 0, -1});
    node(below, geometry(gridMesh(8.0f, 8), material({1, 1, 1, 1})));
    View view = flatView(4.0, {40, 30});
    view.fits = {fitOf(light.id, ShadowMode::VolumeZFail, {1, 0, -1})};
    drawColour(wallViews(view));
    EXPECT_NE(renderer->explain().find("darkness"), std::string::npos);
    EXPECT_EQ(renderer->explain().find("shadow-map"), std::string::npos) << renderer->explain();
    EXPECT_EQ(renderer->explain().find("positions"), std::string::npos) << "volumes need depth alone";
    view.fits = {fitSphere(light.id, {1, 0, -1}, {0, 0, 0}, 12, 64)};
    drawColour(wallViews(view));
    EXPECT_EQ(renderer->explain().find("darkness"), std::string::npos) << renderer->explain();
}

}  // namespace
}  // namespace umbriel
