#include "client/session/light_map_fit.h"

#include <gtest/gtest.h>

#include "client/session/views.h"
#include "common/scene/animation.h"
#include "tests/unit/session/scene_fixture.h"

namespace umbriel {
namespace {

// Two boxes and two lights above them, all of it in a light map of one texel.
class LightMapFits : public SceneFixture {
 protected:
    LightMapFits() {
        sunBeacon = placed(root, {0, 10, 0});
        lampBeacon = placed(root, {1, 6, 0});
        const auto sun = aspect.create<DirectionalLight>("sun");
        aspect.edit(sun).set<&DirectionalLight::beacon>(sunBeacon);
        const auto lamp = aspect.create<SpotLight>("lamp");
        aspect.edit(lamp).set<&SpotLight::beacon>(lampBeacon);
        const auto sunNode = node(root, any(sun.id));
        const auto below = node(sunNode, any(lamp.id));
        firstPlace = placed(below, {0, 0, -8});
        secondPlace = placed(below, {3, 0, -8});
        first = node(firstPlace, any(box()));
        second = node(secondPlace, any(box()));

        const auto camera = aspect.create<PerspectiveCamera>();
        aspect.edit(camera).set<&PerspectiveCamera::beacon>(placed(root, {0, 0, 5}));
        viewport = aspect.create<Viewport>("port");
        aspect.edit(viewport)
            .set<&Viewport::root>(root)
            .set<&Viewport::camera>(any(camera.id))
            .set<&Viewport::shadowMode>(ShadowMode::LightMap);
        window = aspect.create<Window>();
        aspect.edit(window).append<&Window::viewports>(viewport);
    }
    ContainerId box() {
        const auto geometry = aspect.create<Geometry>();
        aspect.edit(geometry)
            .assign<&Geometry::positions>(std::vector<glm::vec3>{{-1, -1, -1}, {1, -1, 1}, {0, 1, 0}})
            .assign<&Geometry::indices>(std::vector<std::uint32_t>{0, 1, 2});
        return geometry.id;
    }
    // Of the scene as it is, without what lies below `without`.
    void bake(Ref<Node> without = {}) {
        const Hierarchy hierarchy(aspect, root);
        std::vector<Ref<Node>> surfaces;
        std::vector<std::uint64_t> states, lights;
        for (const DrawnSurface& drawn : drawnSurfaces(aspect, root, hierarchy)) {
            if (drawn.node == without) continue;
            surfaces.push_back(drawn.node);
            states.push_back(drawn.state);
        }
        for (const LightInEffect& light : lightsInEffect(aspect, root, hierarchy))
            lights.push_back(lightState(aspect, light));
        const auto map = aspect.create<LightMap>();
        aspect.edit(map)
            .set<&LightMap::size>(1u)
            .assign<&LightMap::texels>(std::vector<std::uint8_t>(lights.size(), 0))
            .assign<&LightMap::lightStates>(lights)
            .assign<&LightMap::surfaces>(surfaces)
            .assign<&LightMap::states>(states);
        aspect.edit(viewport).set<&Viewport::lightMap>(map);
    }
    void move(Ref<Node> place, const glm::dvec3& by) {
        const Ref<Transform> transform(aspect.get(place).core.get().id);
        aspect.edit(transform).set<&Transform::translation>(aspect.get(transform).translation.get() + by);
    }
    ResolvedViews resolved() {
        auto views = resolveViews(aspect, window, {640, 480});
        EXPECT_TRUE(views) << (views ? "" : views.error().message);
        return views ? *views : ResolvedViews{};
    }
    // The fits' modes and casters, as in "map0 map1" or "std-moving std-fixed".
    std::string fits() {
        std::string text;
        const ResolvedViews views = resolved();
        for (const ShadowFit& fit : views.views.views[0].fits) {
            if (!text.empty()) text += ' ';
            if (fit.mode == ShadowMode::LightMap)
                text += "map" + std::to_string(fit.layer);
            else
                text += fit.casters == ShadowCasters::All     ? "std"
                        : fit.casters == ShadowCasters::Fixed ? "fixed"
                                                              : "moving";
        }
        return text;
    }
    bool warns(const std::string& about) {
        const ResolvedViews views = resolved();
        for (const std::string& warning : views.warnings)
            if (warning.find(about) != std::string::npos) return true;
        return false;
    }

    Ref<Node> sunBeacon, lampBeacon, firstPlace, secondPlace, first, second;
    Ref<Viewport> viewport;
    Ref<Window> window;
};

TEST_F(LightMapFits, WithoutAMapStandardMapsAreUsedAndSaidSo) {
    EXPECT_EQ(fits(), "std std");
    EXPECT_TRUE(warns("there is no light map"));
}

TEST_F(LightMapFits, LightsThatAreInTheMapNeedNothingElseWhileNothingMoves) {
    bake();
    EXPECT_EQ(fits(), "map0 map1");
    EXPECT_TRUE(resolved().warnings.empty());
}

TEST_F(LightMapFits, WhateverIsNotInTheMapCountsAsMoving) {
    bake(second);
    EXPECT_EQ(fits(), "map0 moving fixed map1 moving fixed");
    EXPECT_TRUE(resolved().warnings.empty());
    move(secondPlace, {0, 1, 0});
    EXPECT_EQ(fits(), "map0 moving fixed map1 moving fixed");
    bake();
    EXPECT_EQ(fits(), "map0 map1");
    node(root, any(box()));
    EXPECT_EQ(fits(), "map0 moving fixed map1 moving fixed");
}

TEST_F(LightMapFits, ACasterThatMovedMakesAllOfTheMapStale) {
    bake();
    move(firstPlace, {0, 1e-6, 0});
    EXPECT_EQ(fits(), "std std");
    EXPECT_TRUE(warns("is stale: 1 of the 2 surfaces"));
    move(firstPlace, {0, -1e-6, 0});
    EXPECT_EQ(fits(), "map0 map1");
    aspect.edit(first).set<&Node::visible>(false);
    EXPECT_EQ(fits(), "std std");
    aspect.edit(first).set<&Node::visible>(true);
    aspect.edit(viewport).append<&Viewport::excludeNodes>(first);
    EXPECT_EQ(fits(), "std std");
}

TEST_F(LightMapFits, ACasterOfAnotherShapeMakesAllOfTheMapStale) {
    bake();
    aspect.edit(Ref<Geometry>(aspect.get(first).core.get().id))
        .setElement<&Geometry::positions>(0, glm::vec3(-1, -1, -2));
    EXPECT_EQ(fits(), "std std");
}

TEST_F(LightMapFits, ALightThatMovedIsStaleAlone) {
    bake();
    move(lampBeacon, {0.01, 0, 0});
    EXPECT_EQ(fits(), "map0 std");
    EXPECT_TRUE(warns("\"lamp\" is not in the light map"));
    EXPECT_FALSE(warns("sun"));
    // Where a light without a place moves to does not matter; where it shines to does.
    move(sunBeacon, {5, 0, 0});
    EXPECT_EQ(fits(), "map0 std");
    aspect.edit(Ref<Transform>(aspect.get(sunBeacon).core.get().id))
        .set<&Transform::linear>(glm::mat3(1, 0, 0, 0, 0, 1, 0, -1, 0));
    EXPECT_EQ(fits(), "std std");
}

TEST_F(LightMapFits, ALightsColourAndConeAreNotInTheMapItsSizeIs) {
    bake();
    const Ref<SpotLight> lamp(lightsInEffect(aspect, root, Hierarchy(aspect, root))[1].core.id);
    aspect.edit(lamp).set<&SpotLight::intensity>(glm::vec3(9.0f)).set<&SpotLight::outerAngle>(0.6f);
    EXPECT_EQ(fits(), "map0 map1");
    aspect.edit(lamp).set<&SpotLight::radius>(0.2f);
    EXPECT_EQ(fits(), "map0 std");
}

TEST_F(LightMapFits, NoWarningForALightThatAnAnimationMoves) {
    bake();
    const auto pose = aspect.create<AnimatedPose>();
    aspect.edit(pose).set<&AnimatedPose::target>(Ref<Transform>(aspect.get(lampBeacon).core.get().id));
    const auto channel = aspect.create<AnimationChannel>();
    aspect.edit(channel).set<&AnimationChannel::pose>(pose);
    move(lampBeacon, {0.5, 0, 0});
    EXPECT_EQ(fits(), "map0 std");
    EXPECT_TRUE(resolved().warnings.empty());
}

TEST_F(LightMapFits, WhatAnAnimationMovesOrDeformsOrChoosesIsKnownToMove) {
    const auto flags = [&] {
        std::vector<bool> moving;
        for (const DrawnSurface& drawn : drawnSurfaces(aspect, root, Hierarchy(aspect, root)))
            moving.push_back(drawn.moves);
        return moving;
    };
    EXPECT_EQ(flags(), (std::vector<bool>{false, false}));
    const auto pose = aspect.create<AnimatedPose>();
    aspect.edit(pose).set<&AnimatedPose::target>(Ref<Transform>(aspect.get(secondPlace).core.get().id));
    const auto channel = aspect.create<AnimationChannel>();
    aspect.edit(channel).set<&AnimationChannel::pose>(pose);
    EXPECT_EQ(flags(), (std::vector<bool>{false, true}));
    const auto deformed = aspect.create<DeformedGeometry>();
    aspect.edit(deformed).set<&DeformedGeometry::geometry>(Ref<Geometry>(aspect.get(first).core.get().id));
    node(root, any(deformed.id));
    const auto level = node(root, any(aspect.create<LevelOfDetail>().id));
    node(level, any(box()));
    EXPECT_EQ(flags(), (std::vector<bool>{false, true, true, true}));
}

TEST_F(LightMapFits, StatesDependOnHolesButNotOnColoursOrNames) {
    const auto state = [&] { return drawnSurfaces(aspect, root, Hierarchy(aspect, root))[0].state; };
    const auto material = aspect.create<Material>();
    const Ref<Geometry> geometry(aspect.get(first).core.get().id);
    aspect.edit(geometry).set<&Geometry::material>(any(material.id));
    const std::uint64_t plain = state();
    aspect.edit(material).set<&Material::baseColour>(glm::vec4(1, 0, 0, 1));
    aspect.edit(first).set<&Container::name>("somebody");
    EXPECT_EQ(state(), plain);
    aspect.edit(material).set<&Material::alphaMode>(AlphaMode::Mask);
    const std::uint64_t masked = state();
    EXPECT_NE(masked, plain);
    aspect.edit(material).set<&Material::alphaCutoff>(0.25f);
    EXPECT_NE(state(), masked);
    aspect.edit(material).set<&Material::alphaMode>(AlphaMode::Blend);
    const std::uint64_t blended = state();
    EXPECT_NE(blended, plain);
    aspect.edit(material).set<&Material::alphaCutoff>(0.75f);
    EXPECT_EQ(state(), blended);
}

}  // namespace
}  // namespace umbriel
