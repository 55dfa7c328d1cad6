#include "client/session/shadow_plane.h"

#include <cmath>

#include "tests/unit/session/scene_fixture.h"

namespace umbriel {
namespace {

class ShadowPlane : public SceneFixture {
 protected:
    // Two triangles with corner, spanned by u and v.
    void addQuad(const glm::vec3& corner, const glm::vec3& u, const glm::vec3& v, Ref<Node> at = {}) {
        const auto geometry = aspect.create<Geometry>();
        aspect.edit(geometry)
            .assign<&Geometry::positions>(std::vector<glm::vec3>{corner, corner + u, corner + u + v, corner + v})
            .assign<&Geometry::indices>(std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3});
        node(at ? at : root, Ref<Container>(geometry.id));
    }
    void addTower(const glm::vec3& foot, float side, float height) {
        const glm::vec3 x(side, 0, 0), y(0, height, 0), z(0, 0, side);
        addQuad(foot, x, y);
        addQuad(foot + z, y, x);
        addQuad(foot, y, z);
        addQuad(foot + x, z, y);
        addQuad(foot + y, z, x);
    }
    std::optional<glm::dvec4> find(const glm::dvec3& travels) {
        LightInEffect sun;
        sun.kind = LightKind::Directional;
        sun.castsShadow = true;
        sun.directionWorld = glm::normalize(travels);
        return largestLitPlane(aspect, root, worldBounds(aspect, root), {sun});
    }
};

// However its quads are wound, cut up, placed and scaled: the floor under towers, and not their larger walls.
TEST_F(ShadowPlane, IsTheFloorThatEverythingStandsOn) {
    const Ref<Node> far = placed(root, {1e6, 40, -1e6});
    for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 4; ++k)
            if ((i + k) % 2 == 0)
                addQuad({5.0f * i, 0, 5.0f * k}, {5, 0, 0}, {0, 0, 5}, far);
            else
                addQuad({5.0f * i, 0, 5.0f * k}, {0, 0, 5}, {5, 0, 0}, far);
    const auto bare = find({0.3, -1, 0.2});
    ASSERT_TRUE(bare) << "a floor alone is the scene";
    EXPECT_NEAR(std::abs(bare->y), 1.0, 1e-9);
    const Ref<Node> old = std::exchange(root, far);
    addTower({4, 0, 4}, 6, 90);
    root = old;
    const auto plane = find({0.3, -1, 0.2});
    ASSERT_TRUE(plane);
    EXPECT_NEAR(plane->y, 1.0, 1e-9) << "towards the scene";
    EXPECT_NEAR(plane->w, -40.0, 1e-6);
}

TEST_F(ShadowPlane, OfARoomIsTheSideThatTheLightReaches) {
    addQuad({0, 0, 0}, {6, 0, 0}, {0, 0, 6});
    addQuad({0, 3, 0}, {6.5, 0, 0}, {0, 0, 6.5});  // the ceiling is larger
    addTower({2, 0, 2}, 1, 1);
    ASSERT_TRUE(find({0.1, -1, 0}));
    EXPECT_GT(find({0.1, -1, 0})->y, 0.9) << "light from above falls on the floor";
    EXPECT_LT(find({0.1, 1, 0})->y, -0.9) << "light from below on the ceiling";
}

TEST_F(ShadowPlane, IsNothingWhereNoFlatFaceHasTheSceneOnOneSide) {
    EXPECT_FALSE(find({0, -1, 0})) << "an empty scene";
    addQuad({-5, 0, -5}, {10, 0, 0}, {0, 0, 10});
    addTower({-1, -9, -1}, 2, 18);  // through the floor, which is in the middle then
    const auto plane = find({0, -1, 0});
    ASSERT_TRUE(!plane || std::abs(plane->w) > 8.0) << "an end of the tower, not the floor in its middle";
}

TEST_F(ShadowPlane, ThatSomebodyNamesIsTurnedToTheLightsAndMustTouchTheScene) {
    LightInEffect sun, lamp;
    sun.kind = LightKind::Directional;
    sun.castsShadow = true;
    sun.directionWorld = {0, -1, 0};
    lamp = sun;
    lamp.kind = LightKind::Point;
    lamp.positionWorld = {3, -5, 1};
    const glm::dvec4 floor(0, 1, 0, -2);
    EXPECT_EQ(towardsLights(floor, {sun}), floor);
    EXPECT_EQ(towardsLights(-floor, {sun}), floor);
    EXPECT_EQ(towardsLights(floor, {lamp}), floor) << "a lamp may be below a floor";
    EXPECT_EQ(towardsLights(floor, {sun, lamp}), floor) << "from both sides: as it is named";
    EXPECT_EQ(towardsLights(-floor, {sun, lamp}), -floor);
    EXPECT_EQ(towardsLights(floor, {}), floor);
    const Box3d box{glm::dvec3(-10, 2.01, -10), glm::dvec3(10, 12, 10)};
    EXPECT_TRUE(touches(floor, box)) << "what stands on it is rarely modelled to the millimetre";
    EXPECT_TRUE(touches({0, -1, 0, 12}, box));
    EXPECT_FALSE(touches({0, 1, 0, 5}, box));
    EXPECT_FALSE(touches({0, 1, 0, 1e30}, box));
    EXPECT_FALSE(touches(floor, Box3d()));
}

}  // namespace
}  // namespace umbriel
