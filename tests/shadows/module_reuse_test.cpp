#include "tests/shadows/shadow_fixture.h"

namespace umbriel {
namespace {

class Reuse : public ModuleTest {
 protected:
    void SetUp() override {
        ModuleTest::SetUp();
        buildTown(30.0, 40);
        finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
        moving = placed(lightNode, toWorld({0, 5, 20}));
        node(moving, geometry(boxMesh({1, 1, 1}), material({1, 1, 1, 1})));
        look({0, 4, 28}, {0, 1, 0});
        scene->edit(viewport).set<&Viewport::reuseMaps>(true).set<&Viewport::mapSize>(512u);
    }
    // Shadow triangles of a draw of the whole wall.
    std::uint64_t drawn(int columns = 1, int rows = 1) {
        images = drawWall(resolved(kWall), columns, rows);
        return statistics.shadowTriangles;
    }
    // The same without anything kept.
    std::vector<WallImage> fresh() {
        scene->edit(viewport).set<&Viewport::reuseMaps>(false);
        const auto result = drawWall(resolved(kWall));
        scene->edit(viewport).set<&Viewport::reuseMaps>(true);
        return result;
    }
    void move(const glm::dvec3& to) {
        const Node* found = scene->find(moving);
        scene->edit(Ref<Transform>(found->core.get().id)).set<&Transform::translation>(toWorld(to));
    }
    // Looking at the middle.
    void moveEye(const glm::dvec3& to) {
        const auto* camera = scene->findAs<PerspectiveCamera>(scene->find(viewport)->camera.get().id);
        const Node* beacon = scene->find(camera->beacon.get());
        scene->edit(Ref<Transform>(beacon->core.get().id))
            .set<&Transform::translation>(toWorld(to))
            .set<&Transform::linear>(lookingAlong(glm::vec3(toWorld({0, 1, 0}) - toWorld(to))));
    }
    static constexpr PixelSize kWall{160, 100};
    Ref<Node> moving;
    std::vector<WallImage> images;
};

TEST_F(Reuse, NothingIsDrawnAgainWhileNothingMoves) {
    for (const ShadowMode mode :
         {ShadowMode::Standard, ShadowMode::LightSpacePerspective, ShadowMode::PercentageCloser}) {
        scene->edit(viewport).set<&Viewport::shadowMode>(mode);
        EXPECT_GT(drawn(), 0u);
        EXPECT_EQ(drawn(), 0u);
        const auto kept = images;
        const auto again = fresh();
        for (std::size_t i = 0; i < kept.size(); ++i) EXPECT_EQ(differingPixels(kept[i], again[i]), 0u) << i;
    }
}

TEST_F(Reuse, AMovedCasterIsDrawnWhereItIs) {
    drawn();
    for (int i = 0; i < 3; ++i) {
        move({0.5 * i, 5, 19});
        EXPECT_GT(drawn(), 0u);
        EXPECT_EQ(drawn(), 0u);
        const auto kept = images;
        const auto again = fresh();
        EXPECT_EQ(differingPixels(kept[3], again[3]), 0u);
        drawn();
    }
}

TEST_F(Reuse, AMovedLightIsDrawnAgain) {
    drawn();
    EXPECT_EQ(drawn(), 0u);
    const auto sun = scene->create<DirectionalLight>("another");
    scene->edit(sun).set<&DirectionalLight::beacon>(placed(root, {0, 0, 0}, lookingAlong({0.4f, -0.8f, 0.2f})));
    node(lightNode, sun);
    scene->edit(lightNode);
    // One more light: one more map; the first one's is as it was unless its layer was given away.
    EXPECT_GT(drawn(), 0u);
    EXPECT_EQ(drawn(), 0u);
}

// With the scene's fit the map does not depend on the eye: an eye that goes round has it drawn twice at most, for what
// it saw first and then all of it.
TEST_F(Reuse, AnEyeThatMovesHasTheScenesMapDrawnTwiceAtMost) {
    scene->edit(viewport).set<&Viewport::shadowFit>(ShadowFitMode::Scene);
    int draws = 0;
    for (int i = 0; i < 12; ++i) {
        moveEye({28 * std::sin(0.5 * i), 4, 28 * std::cos(0.5 * i)});
        draws += drawn() > 0;
        const auto kept = images;
        EXPECT_EQ(differingPixels(kept[3], fresh()[3]), 0u) << i;
        drawn();
    }
    EXPECT_LE(draws, 14);
    // Now without fresh() in between, which gives away what was kept.
    draws = 0;
    for (int i = 0; i < 12; ++i) {
        moveEye({28 * std::sin(0.5 * i), 4, 28 * std::cos(0.5 * i)});
        draws += drawn() > 0;
    }
    EXPECT_LE(draws, 2);
}

// The masks of tiles differ: what is kept for one does for another only when it covers it.
TEST_F(Reuse, TilesOfOneServerGetWhatTheyNeed) {
    drawn(3, 2);
    const auto tiled = images;
    EXPECT_EQ(differingPixels(tiled[3], fresh()[3]), 0u);
    drawn(3, 2);
    EXPECT_EQ(drawn(3, 2), 0u);
    EXPECT_EQ(differingPixels(images[3], tiled[3]), 0u);
}

TEST_F(Reuse, AModuleThatNobodyUsesCostsNothing) {
    scene->edit(viewport).set<&Viewport::shadowMode>(ShadowMode::None);
    EXPECT_EQ(drawn(), 0u);
    const std::string none = renderer->explain();
    EXPECT_EQ(none.find("shadow"), std::string::npos) << none;
    scene->edit(viewport).set<&Viewport::shadowMode>(ShadowMode::Standard);
    drawn();
    const std::string plain = renderer->explain();
    EXPECT_EQ(plain.find("warped"), std::string::npos);
    EXPECT_EQ(plain.find("cube"), std::string::npos);
    EXPECT_EQ(plain.find("filtered"), std::string::npos);
    EXPECT_EQ(plain.find("bounds"), std::string::npos);
    EXPECT_EQ(plain.find("paraboloid"), std::string::npos);
    scene->edit(viewport).set<&Viewport::shadowMode>(ShadowMode::Trapezoid);
    drawn();
    EXPECT_NE(renderer->explain().find("trapezoid"), std::string::npos);
    EXPECT_NE(renderer->explain().find("warped-maps"), std::string::npos);
}

}  // namespace
}  // namespace umbriel
