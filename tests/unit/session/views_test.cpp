#include "client/session/views.h"

#include <cmath>

#include "tests/unit/session/scene_fixture.h"

namespace umbriel {
namespace {

class Views : public SceneFixture {
 protected:
    Views() {
        addBox({-1, 0, -1}, {1, 1, 1});
        window = aspect.create<Window>();
        camera = any(*addCamera(aspect, "eye", {{0, 1, 6}, {0, 0.5, 0}, {0, 1, 0}, 0.8}));
    }
    Ref<Viewport> addViewport(const glm::vec2& lowerLeft = glm::vec2(0.0f),
                              const glm::vec2& upperRight = glm::vec2(1.0f)) {
        const auto viewport = aspect.create<Viewport>("port");
        aspect.edit(viewport)
            .set<&Viewport::lowerLeft>(lowerLeft)
            .set<&Viewport::upperRight>(upperRight)
            .set<&Viewport::root>(root)
            .set<&Viewport::camera>(camera);
        aspect.edit(window).append<&Window::viewports>(viewport);
        return viewport;
    }
    PixelRect region(const glm::vec2& lowerLeft, const glm::vec2& upperRight, PixelSize wall) {
        return *resolveRegion(aspect.get(addViewport(lowerLeft, upperRight)), wall);
    }
    Ref<Window> window;
    Ref<Container> camera;
};

TEST_F(Views, CornersAreFractionsUpToOneAndPixelsAbove) {
    EXPECT_EQ(region({0, 0}, {1, 1}, {1277, 719}), (PixelRect{0, 0, 1277, 719}));
    EXPECT_EQ(region({0.5f, 0.25f}, {1, 1}, {100, 80}), (PixelRect{50, 20, 50, 60}));
    EXPECT_EQ(region({10, 20}, {110, 70}, {640, 480}), (PixelRect{10, 20, 100, 50}));
    EXPECT_EQ(region({0.5f, 0}, {600, 1}, {640, 480}), (PixelRect{320, 0, 280, 480}));
}

TEST_F(Views, NeighbouringFractionsShareTheirBorder) {
    for (int width = 1; width < 300; ++width) {
        const PixelRect left = region({0, 0}, {1.0f / 3.0f, 1}, {width, 10});
        const PixelRect right = region({1.0f / 3.0f, 0}, {1, 1}, {width, 10});
        EXPECT_EQ(left.x + left.width, right.x);
        EXPECT_EQ(right.x + right.width, width);
    }
}

TEST_F(Views, ViewportsComeBackToFrontAndPassiveOnesNotAtAll) {
    const Ref<Viewport> first = addViewport(), second = addViewport({0.5f, 0.5f}),
                        third = addViewport({700, 10}, {800, 20});
    aspect.edit(addViewport()).set<&Viewport::passive>(true);
    const auto resolved = resolveViews(aspect, window, {640, 480});
    ASSERT_TRUE(resolved);
    ASSERT_EQ(resolved->views.views.size(), 2u);  // the third lies beyond the wall
    EXPECT_EQ(resolved->views.views[0].viewport, first.id);
    EXPECT_EQ(resolved->views.views[1].viewport, second.id);
    EXPECT_EQ(resolved->views.views[1].region, (PixelRect{320, 240, 320, 240}));
    EXPECT_EQ(resolved->views.wall, (PixelSize{640, 480}));
    EXPECT_EQ(resolveViews(aspect, window, {1000, 480})->views.views[2].viewport, third.id);
}

TEST_F(Views, ImpossibleViewportsAreRefusedByName) {
    const Ref<Viewport> viewport = addViewport();
    const auto refused = [&](const glm::vec2& lowerLeft, const glm::vec2& upperRight) {
        aspect.edit(viewport).set<&Viewport::lowerLeft>(lowerLeft).set<&Viewport::upperRight>(upperRight);
        const auto resolved = resolveViews(aspect, window, {640, 480});
        return resolved.has_error() && resolved.error().message.find("\"port\"") != std::string::npos;
    };
    EXPECT_TRUE(refused({-0.1f, 0}, {1, 1}));
    EXPECT_TRUE(refused({0, 0}, {NAN, 1}));
    EXPECT_TRUE(refused({0, 0}, {1, INFINITY}));
    EXPECT_TRUE(refused({0.6f, 0}, {0.5f, 1}));
    EXPECT_TRUE(refused({0.5f, 0.5f}, {0.5f, 0.5f}));
    EXPECT_TRUE(refused({0, 0}, {1e9f, 1}));
    EXPECT_FALSE(refused({0, 0}, {1, 1}));
    EXPECT_FALSE(resolveViews(aspect, window, {0, 480}));
    EXPECT_FALSE(resolveViews(aspect, Ref<Window>(), {640, 480}));
    aspect.edit(viewport).set<&Viewport::shadowMode>(ShadowMode::VisibilityMap);
    EXPECT_NE(resolveViews(aspect, window, {640, 480}).error().message.find("'visibility-map'"), std::string::npos);
    aspect.edit(viewport).set<&Viewport::shadowMode>(ShadowMode::None).set<&Viewport::camera>(Ref<Container>());
    EXPECT_FALSE(resolveViews(aspect, window, {640, 480}));
    aspect.edit(viewport).set<&Viewport::root>(Ref<Node>());
    EXPECT_TRUE(resolveViews(aspect, window, {640, 480}));  // a background alone
}

TEST_F(Views, ShadowsOnlyWhereAskedFor) {
    node(root, any(aspect.create<DirectionalLight>()));
    const Ref<Viewport> viewport = addViewport();
    const auto fits = [&] { return resolveViews(aspect, window, {640, 480})->views.views[0].fits; };
    EXPECT_TRUE(fits().empty());
    aspect.edit(viewport).set<&Viewport::shadowMode>(ShadowMode::Standard).set<&Viewport::mapSize>(0u);
    ASSERT_EQ(fits().size(), 1u);
    EXPECT_EQ(fits()[0].mapSize, 256u);
    EXPECT_EQ(fits()[0].mode, ShadowMode::Standard);
    aspect.edit(viewport).set<&Viewport::shadowOn>(false);
    EXPECT_TRUE(fits().empty());
}

TEST_F(Views, BothEyesShareTheUnionsMapAndPerViewDoesNot) {
    node(root, any(aspect.create<DirectionalLight>()));
    addBox({-50, 0, -50}, {50, 1, 50});
    std::vector<Ref<Viewport>> viewports;
    for (const Eye eye : {Eye::Left, Eye::Right}) {
        const auto stereo = aspect.create<StereoCameraDecorator>();
        aspect.edit(stereo)
            .set<&StereoCameraDecorator::camera>(camera)
            .set<&StereoCameraDecorator::eye>(eye)
            .set<&StereoCameraDecorator::separation>(6.0);
        const Ref<Viewport> viewport = addViewport();
        aspect.edit(viewport).set<&Viewport::camera>(any(stereo)).set<&Viewport::shadowMode>(ShadowMode::Standard);
        viewports.push_back(viewport);
    }
    auto views = resolveViews(aspect, window, {640, 480})->views.views;
    ASSERT_EQ(views.size(), 2u);
    EXPECT_EQ(views[0].eye, Eye::Left);
    EXPECT_EQ(views[0].fits[0].clipFromWorld, views[1].fits[0].clipFromWorld);
    for (const Ref<Viewport> viewport : viewports)
        aspect.edit(viewport).set<&Viewport::shadowFit>(ShadowFitMode::PerView);
    views = resolveViews(aspect, window, {640, 480})->views.views;
    EXPECT_NE(views[0].fits[0].clipFromWorld, views[1].fits[0].clipFromWorld);
}

TEST_F(Views, WarningsComeOnceAndViewsAreTheSameEveryTime) {
    const auto spot = aspect.create<SpotLight>("wide");
    aspect.edit(spot).set<&SpotLight::outerAngle>(1.57079633f);
    node(root, any(spot));
    for (int i = 0; i < 3; ++i)
        aspect.edit(addViewport())
            .set<&Viewport::shadowMode>(ShadowMode::Standard)
            .set<&Viewport::shadowFit>(ShadowFitMode::PerView);
    GeometryBounds bounds;
    const auto a = resolveViews(aspect, window, {640, 480}, &bounds),
               b = resolveViews(aspect, window, {640, 480}, &bounds);
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->warnings.size(), 1u);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(a->views.views[i].clipFromView, b->views.views[i].clipFromView);
}

}  // namespace
}  // namespace umbriel
