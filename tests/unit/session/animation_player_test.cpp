#include "client/session/animation_player.h"

#include <bit>
#include <cmath>
#include <numbers>

#include "tests/unit/session/scene_fixture.h"

namespace umbriel {
namespace {

class Player : public SceneFixture {
 protected:
    Player() {
        target = aspect.create<Transform>();
        pose = aspect.create<AnimatedPose>();
        aspect.edit(pose).set<&AnimatedPose::target>(target).set<&AnimatedPose::translation>(glm::dvec3(1e6, 2, 3));
        animation = aspect.create<Animation>();
        scene = aspect.create<LoadedScene>();
        aspect.edit(scene).append<&LoadedScene::animations>(animation);
        aspect.edit(animation).set<&Animation::duration>(4.0);
    }
    Ref<AnimationChannel> add(AnimationPath path, AnimationInterpolation interpolation, const std::vector<float>& times,
                              const std::vector<float>& values) {
        const auto channel = aspect.create<AnimationChannel>();
        aspect.edit(channel)
            .set<&AnimationChannel::pose>(pose)
            .set<&AnimationChannel::path>(path)
            .set<&AnimationChannel::interpolation>(interpolation)
            .assign<&AnimationChannel::times>(times)
            .assign<&AnimationChannel::values>(values);
        aspect.edit(animation).append<&Animation::channels>(channel);
        return channel;
    }
    const Transform& at(double time) {
        AnimationPlayer(aspect, scene).advanceTo(time, aspect);
        return aspect.get(target);
    }
    Ref<Transform> target;
    Ref<AnimatedPose> pose;
    Ref<Animation> animation;
    Ref<LoadedScene> scene;
};

TEST_F(Player, LinearTranslationIsLinearHeldAtTheEndsAndLooped) {
    add(AnimationPath::Translation, AnimationInterpolation::Linear, {1, 3}, {0, 0, 0, 8, -4, 2});
    EXPECT_EQ(at(0.0).translation.get(), glm::dvec3(0, 0, 0));
    EXPECT_EQ(at(1.5).translation.get(), glm::dvec3(2, -1, 0.5));
    EXPECT_EQ(at(3.5).translation.get(), glm::dvec3(8, -4, 2));
    EXPECT_EQ(at(5.5).translation.get(), glm::dvec3(2, -1, 0.5));
    EXPECT_EQ(at(-2.5).translation.get(), glm::dvec3(2, -1, 0.5));
}

TEST_F(Player, MorphWeightsFollowTheirKeys) {
    const auto morph = aspect.create<MorphWeights>();
    aspect.edit(morph).assign<&MorphWeights::weights>({0.5f, 0.5f});
    const auto weights = [&](double time) {
        at(time);
        return aspect.get(morph).weights.toVector();
    };
    const auto channel = add(AnimationPath::Weights, AnimationInterpolation::Linear, {1, 3}, {0, 1, 0.5f, -1});
    aspect.edit(channel).set<&AnimationChannel::morph>(morph);
    EXPECT_EQ(weights(0.0), (std::vector<float>{0, 1}));
    EXPECT_EQ(weights(2.0), (std::vector<float>{0.25f, 0}));
    EXPECT_EQ(weights(3.5), (std::vector<float>{0.5f, -1}));
    aspect.edit(channel).set<&AnimationChannel::interpolation>(AnimationInterpolation::Step);
    EXPECT_EQ(weights(2.999), (std::vector<float>{0, 1}));
    // In-tangents, values, out-tangents of all weights. With tangents 0 the middle is halfway; an out-tangent m at the
    // first key adds m * span / 8 there (glTF 2.0, C.5).
    aspect.edit(channel)
        .set<&AnimationChannel::interpolation>(AnimationInterpolation::CubicSpline)
        .assign<&AnimationChannel::values>({9, 9, 0, 1, 0, 2, 0, 0, 0.5f, -1, 9, 9});
    EXPECT_EQ(weights(2.0), (std::vector<float>{0.25f, 0.5f}));
    EXPECT_EQ(weights(3.0), (std::vector<float>{0.5f, -1}));
    aspect.edit(channel).assign<&AnimationChannel::values>({1, 2, 3});
    EXPECT_EQ(weights(3.0), (std::vector<float>{0.5f, -1})) << "values that do not suit the keys change nothing";
}

TEST_F(Player, StepsHoldUntilTheNextKey) {
    add(AnimationPath::Scale, AnimationInterpolation::Step, {0, 1, 2}, {1, 1, 1, 2, 3, 4, 5, 5, 5});
    EXPECT_EQ(at(0.999).linear.get(), glm::mat3(1.0f));
    EXPECT_EQ(at(1.0).linear.get(), glm::mat3(2, 0, 0, 0, 3, 0, 0, 0, 4));
    EXPECT_EQ(at(1.999).linear.get(), glm::mat3(2, 0, 0, 0, 3, 0, 0, 0, 4));
}

TEST_F(Player, WhatIsNotAnimatedKeepsItsPose) {
    add(AnimationPath::Scale, AnimationInterpolation::Linear, {0}, {2, 2, 2});
    EXPECT_EQ(at(1.0).translation.get(), glm::dvec3(1e6, 2, 3));
}

TEST_F(Player, RotationsTakeTheShortArcAtConstantSpeed) {
    const float h = std::sqrt(0.5f);
    // 0 to 90 degrees about z; the second key negated, which is the same rotation.
    add(AnimationPath::Rotation, AnimationInterpolation::Linear, {0, 1}, {0, 0, 0, 1, 0, 0, -h, -h});
    for (int i = 0; i <= 10; ++i) {
        const double angle = 0.5 * std::numbers::pi * i / 10;
        const glm::mat3 linear = at(0.1 * i).linear;
        EXPECT_NEAR(linear[0].x, std::cos(angle), 1e-6);
        EXPECT_NEAR(linear[0].y, std::sin(angle), 1e-6);
        EXPECT_NEAR(linear[2].z, 1.0, 1e-6);
    }
}

TEST_F(Player, NearlyEqualRotationsStayUnitLength) {
    const auto channel =
        add(AnimationPath::Rotation, AnimationInterpolation::Linear, {0, 1}, {0, 0, 0, 1, 1e-8f, 0, 0, 1});
    glm::dvec4 value;
    ASSERT_TRUE(evaluate(aspect.get(channel), 0.5, value));
    EXPECT_NEAR(glm::length(value), 1.0, 1e-15);
    EXPECT_NEAR(value.x, 0.5e-8, 1e-12);
}

// A cubic given by its Hermite data is reproduced: x = t^3 - 2 t between 1 and 3.
TEST_F(Player, CubicSplinesReproduceCubics) {
    const auto f = [](double t) { return t * t * t - 2.0 * t; };
    const auto slope = [](double t) { return static_cast<float>(3.0 * t * t - 2.0); };
    const auto channel = add(AnimationPath::Translation, AnimationInterpolation::CubicSpline, {1, 3},
                             {0, 0, 0, static_cast<float>(f(1)), 0, 5, slope(1), 0, 0, slope(3), 0, 0,
                              static_cast<float>(f(3)), 0, 5, 0, 0, 0});
    for (int i = 0; i <= 20; ++i) {
        const double t = 1.0 + 0.1 * i;
        glm::dvec4 value;
        ASSERT_TRUE(evaluate(aspect.get(channel), t, value));
        EXPECT_NEAR(value.x, f(t), 1e-12);
        EXPECT_NEAR(value.z, 5.0, 1e-12);
    }
}

TEST_F(Player, UnchangedTransformsAreNotEdited) {
    add(AnimationPath::Translation, AnimationInterpolation::Step, {0, 1}, {1, 2, 3, 4, 5, 6});
    at(0.1);
    aspect.commit();
    at(0.2);
    EXPECT_TRUE(aspect.commit().empty());
    at(1.5);
    const ChangeList changes = aspect.commit();
    ASSERT_EQ(changes.changed.size(), 1u);
    EXPECT_EQ(changes.changed[0].id, target.id);
    EXPECT_EQ(std::popcount(changes.changed[0].fields), 1);
}

TEST_F(Player, BrokenChannelsAreSkipped) {
    add(AnimationPath::Translation, AnimationInterpolation::Linear, {0, 1}, {1, 2});
    add(AnimationPath::Rotation, AnimationInterpolation::CubicSpline, {0}, {0, 0, 0, 1});
    add(AnimationPath::Translation, AnimationInterpolation::Linear, {}, {});
    add(AnimationPath::Scale, AnimationInterpolation::Linear, {0}, {INFINITY, 1, 1});
    EXPECT_EQ(at(0.5).linear.get(), glm::mat3(1.0f));
    aspect.destroy(target);
    AnimationPlayer(aspect, scene).advanceTo(0.5, aspect);
    AnimationPlayer(aspect, Ref<LoadedScene>()).advanceTo(0.5, aspect);
}

}  // namespace
}  // namespace umbriel
