#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "client/session/camera.h"
#include "client/session/shadow_fit.h"
#include "client/session/views.h"
#include "tests/unit/session/scene_fixture.h"

namespace umbriel {
namespace {

// What cannot be done as asked is done in the nearest way that can, and said.

class Wishes : public SceneFixture {
 protected:
    ShadowFitRequest request() {
        messages.clear();
        return requestOf(*aspect.find(viewport), 512, messages);
    }
    Ref<Viewport> viewport = aspect.create<Viewport>("main");
    std::vector<std::string> messages;
};

TEST_F(Wishes, ImpossibleValuesAreReplacedWithAMessage) {
    EXPECT_TRUE((request(), messages.empty()));
    for (const float range : {0.8f, 2.0f}) {
        aspect.edit(viewport).set<&Viewport::range>(range);
        EXPECT_EQ(request().range, 0.8f);
        ASSERT_EQ(messages.size(), 1u);
        EXPECT_NE(messages[0].find("range"), std::string::npos);
    }
    for (const float range : {0.0f, -1.0f, std::numeric_limits<float>::quiet_NaN()}) {
        aspect.edit(viewport).set<&Viewport::range>(range);
        EXPECT_EQ(request().range, 0.3f);
        EXPECT_EQ(messages.size(), 1u);
    }
    aspect.edit(viewport).set<&Viewport::range>(0.3f).set<&Viewport::lispFactor>(0.0f).set<&Viewport::maxSideAngle>(
        9.0f);
    EXPECT_EQ(request().lispFactor, 1.0f);
    EXPECT_EQ(messages.size(), 2u);
    aspect.edit(viewport)
        .set<&Viewport::lispFactor>(1.0f)
        .set<&Viewport::maxSideAngle>(1.0f)
        .set<&Viewport::shadowMode>(ShadowMode::PercentageCloser)
        .set<&Viewport::samplesPerRow>(0u)
        .set<&Viewport::filterWidth>(-3.0f)
        .set<&Viewport::filteredMap>(ShadowMode::Blob);
    EXPECT_EQ(request().filter.samplesPerRow, 6u);
    EXPECT_EQ(request().filter.widthTexels, 8.0f);
    EXPECT_EQ(request().map, ShadowMode::Standard);
    EXPECT_EQ(messages.size(), 3u);
}

TEST_F(Wishes, ValuesThatWouldTakeShadowsAwayAreReplacedWithAMessage) {
    const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
    for (const float huge : {1e9f, 1e30f, inf, nan}) {
        aspect.edit(viewport).set<&Viewport::offFactor>(huge).set<&Viewport::offBias>(huge).set<&Viewport::lightSize>(
            huge);
        const ShadowFitRequest made = request();
        EXPECT_EQ(made.offFactor, -1.0f);
        EXPECT_EQ(made.offBias, -1.0f);
        EXPECT_EQ(made.lightSize, -1.0f);
        ASSERT_EQ(messages.size(), 3u) << huge;
        EXPECT_NE(messages[0].find("offFactor"), std::string::npos);
        EXPECT_NE(messages[1].find("offBias"), std::string::npos);
        EXPECT_NE(messages[2].find("lightSize"), std::string::npos);
    }
    aspect.edit(viewport).set<&Viewport::offFactor>(-5.0f).set<&Viewport::offBias>(3.0f).set<&Viewport::lightSize>(
        2.0f);
    EXPECT_EQ(request().offFactor, -5.0f);
    EXPECT_TRUE(messages.empty());
    aspect.edit(viewport).set<&Viewport::shadowMode>(ShadowMode::PercentageCloser);
    for (const float bad : {1e9f, 1e38f, inf, nan, -1.0f}) {
        aspect.edit(viewport).set<&Viewport::filterMetres>(bad);
        EXPECT_EQ(request().filter.widthMetres, 0.0f) << bad;
        ASSERT_EQ(messages.size(), 1u) << bad;
        EXPECT_NE(messages[0].find("filterMetres"), std::string::npos);
    }
    aspect.edit(viewport).set<&Viewport::filterMetres>(9e8f);
    EXPECT_EQ(request().filter.widthMetres, 9e8f);
    EXPECT_TRUE(messages.empty());
    aspect.edit(viewport).set<&Viewport::planeNormal>(glm::dvec3(0, 2, 0)).set<&Viewport::planeOffset>(1e300);
    EXPECT_EQ(request().planeWorld, glm::dvec4(0.0));
    ASSERT_EQ(messages.size(), 1u);
    EXPECT_NE(messages[0].find("planeOffset"), std::string::npos);
}

TEST_F(Wishes, ShadowColoursAreSharesOfALight) {
    const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
    for (const auto& [given, possible] :
         {std::pair{glm::vec3(2, -1, 0.5f), glm::vec3(1, 0, 0.5f)}, {glm::vec3(inf, -inf, nan), glm::vec3(1, 0, 0)}}) {
        aspect.edit(viewport).set<&Viewport::shadowColor>(given);
        request();
        ASSERT_EQ(messages.size(), 1u);
        EXPECT_NE(messages[0].find("shadowColor"), std::string::npos);
        EXPECT_EQ(possibleShadowColour(given), possible);
    }
    for (const glm::vec3 sound : {glm::vec3(0.0f), glm::vec3(1.0f), glm::vec3(0.1f, 0.7f, 1e-7f)}) {
        aspect.edit(viewport).set<&Viewport::shadowColor>(sound);
        EXPECT_TRUE((request(), messages.empty()));
        EXPECT_EQ(possibleShadowColour(sound), sound);
    }
}

class BadLights : public SceneFixture {
 protected:
    ShadowFits fits(ShadowMode mode = ShadowMode::Standard) {
        ShadowFitRequest request;
        request.fit = ShadowFitMode::Scene;
        request.mode = request.map = mode;
        request.planeWorld = planeWorld;
        return fitShadows(aspect, lightsInEffect(aspect, root, Hierarchy(aspect, root)), worldBounds(aspect, root), {},
                          request);
    }
    glm::dvec4 planeWorld{0.0};
};

TEST_F(BadLights, WithoutADirectionShineAlongMinusZWithAShadow) {
    addBox({-1, -1, -1}, {1, 1, 1});
    const auto sun = aspect.create<DirectionalLight>("nowhere");
    node(root, any(sun));
    for (const float scale : {0.0f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
        aspect.edit(sun).set<&DirectionalLight::beacon>(placed(root, {0, 0, 0}, glm::mat3(scale)));
        for (const ShadowMode mode :
             {ShadowMode::Standard, ShadowMode::LightSpacePerspective, ShadowMode::VolumeZFail}) {
            const ShadowFits result = fits(mode);
            ASSERT_EQ(result.messages.size(), 1u) << scale;
            EXPECT_NE(result.messages[0].find("\"nowhere\""), std::string::npos);
            EXPECT_NE(result.messages[0].find("no direction"), std::string::npos);
            ASSERT_EQ(result.fits.size(), 1u);
            EXPECT_TRUE(isFinite(result.fits[0].clipFromWorld));
            EXPECT_EQ(result.fits[0].worldFromLight[2], glm::dvec3(0, 0, 1));
        }
    }
}

TEST_F(BadLights, WithAConeOfNothingLightNothingAndSaySo) {
    addBox({-1, -1, -1}, {1, 1, 1});
    const auto spot = aspect.create<SpotLight>("narrow");
    node(placed(root, {0, 0, 4}), any(spot));
    for (const float angle : {0.0f, -1.0f, std::numeric_limits<float>::quiet_NaN()}) {
        aspect.edit(spot).set<&SpotLight::outerAngle>(angle);
        const ShadowFits result = fits();
        ASSERT_EQ(result.messages.size(), 1u) << angle;
        EXPECT_NE(result.messages[0].find("\"narrow\""), std::string::npos);
        EXPECT_TRUE(result.fits.empty());
    }
}

TEST_F(BadLights, WiderThanAMapCanSeeGetACube) {
    addBox({-1, -1, -1}, {1, 1, 1});
    const auto spot = aspect.create<SpotLight>("wide");
    node(placed(root, {0, 0, 4}), any(spot));
    for (const float angle : {1.57079633f, 2.5f, 3.1415927f})
        for (const ShadowMode mode :
             {ShadowMode::Standard, ShadowMode::LightSpacePerspective, ShadowMode::DualParaboloid}) {
            aspect.edit(spot).set<&SpotLight::outerAngle>(angle);
            const ShadowFits result = fits(mode);
            ASSERT_EQ(result.messages.size(), 1u) << angle;
            EXPECT_NE(result.messages[0].find("\"wide\""), std::string::npos);
            ASSERT_EQ(result.fits.size(), 6u);
            for (const ShadowFit& fit : result.fits) EXPECT_EQ(fit.shape, ShadowShape::CubeFace);
        }
    aspect.edit(spot).set<&SpotLight::outerAngle>(1.5f);
    EXPECT_TRUE(fits().messages.empty());
    EXPECT_EQ(fits().fits.size(), 1u);
}

TEST_F(BadLights, OnThePlaneOfPlanarShadowsAreNamed) {
    addBox({-1, 0, -1}, {1, 1, 1});
    planeWorld = {0, 1, 0, 0};
    const auto lamp = aspect.create<PointLight>("lamp");
    node(root, any(lamp));
    for (const double height : {0.0, -3.0, 1e-13, 3.0}) {
        aspect.edit(lamp).set<&PointLight::beacon>(placed(root, {50.0, height, 0}));
        for (const ShadowMode mode : {ShadowMode::Planar, ShadowMode::PlanarStencil})
            EXPECT_EQ(fits(mode).messages.size(), height == 3.0 ? 0u : 1u) << height;
        EXPECT_TRUE(fits(ShadowMode::VolumeZFail).messages.empty());
    }
}

class BadViews : public SceneFixture {
 protected:
    void SetUp() override {
        aspect.edit(window).append<&Window::viewports>(viewport);
        aspect.edit(viewport).set<&Viewport::root>(root);
        node(root, any(aspect.create<DirectionalLight>("sun")));
        LookAt pose;
        pose.eyeWorld = {0, 2, 9};
        const auto camera = addCamera(aspect, "camera", pose);
        ASSERT_TRUE(camera);
        aspect.edit(viewport).set<&Viewport::camera>(Ref<Container>(camera->id));
    }
    ResolvedViews resolved() {
        const auto views = resolveViews(aspect, window, {300, 200});
        EXPECT_TRUE(views);
        return views ? *views : ResolvedViews{};
    }
    Ref<Window> window = aspect.create<Window>();
    Ref<Viewport> viewport = aspect.create<Viewport>("main");
};

TEST_F(BadViews, MapSizesOfNothingAndBeyondTheLimitAreReplaced) {
    addBox({-1, -1, -1}, {1, 1, 1});
    aspect.edit(viewport).set<&Viewport::shadowMode>(ShadowMode::Standard);
    aspect.edit(viewport).set<&Viewport::mapSize>(0u);
    EXPECT_EQ(resolved().views.views[0].fits.at(0).mapSize, 128u);  // the largest power of two within 300 x 200
    EXPECT_TRUE(resolved().warnings.empty());
    aspect.edit(viewport).set<&Viewport::mapSize>(4000000000u);
    const ResolvedViews large = resolved();
    ASSERT_EQ(large.warnings.size(), 1u);
    EXPECT_NE(large.warnings[0].find("4000000000"), std::string::npos);
    ASSERT_EQ(large.views.views[0].fits.size(), 1u);
    EXPECT_TRUE(isFinite(large.views.views[0].fits[0].clipFromWorld));
}

TEST_F(BadViews, OpenMeshesUnderVolumesAreNamedOnce) {
    addBox({-1, -1, -1}, {1, 1, 1});
    for (const ShadowMode mode : {ShadowMode::VolumeZPass, ShadowMode::VolumeZFail, ShadowMode::Standard}) {
        aspect.edit(viewport).set<&Viewport::shadowMode>(mode);
        EXPECT_TRUE(resolved().warnings.empty() || mode != ShadowMode::Standard);
    }
    const auto leaf = aspect.create<Geometry>("leaf");
    aspect.edit(leaf)
        .assign<&Geometry::positions>(std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})
        .assign<&Geometry::indices>(std::vector<std::uint32_t>{0, 1, 2});
    const Ref<Node> held = node(root, any(leaf));
    for (const ShadowMode mode : {ShadowMode::VolumeZPass, ShadowMode::VolumeZFail}) {
        aspect.edit(viewport).set<&Viewport::shadowMode>(mode);
        const ResolvedViews views = resolved();
        ASSERT_EQ(views.warnings.size(), 1u);
        EXPECT_NE(views.warnings[0].find("no closed surface"), std::string::npos) << views.warnings[0];
        EXPECT_EQ(views.views.views[0].fits.size(), 1u);
    }
    aspect.edit(viewport).set<&Viewport::shadowMode>(ShadowMode::Standard);
    EXPECT_TRUE(resolved().warnings.empty());
    static_cast<void>(held);
}

}  // namespace
}  // namespace umbriel
