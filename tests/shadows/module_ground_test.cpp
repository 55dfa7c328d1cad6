#include "tests/shadows/shadow_fixture.h"

// What lies behind everything, seen from the light, is in no map (server/draw/backmost.h).

namespace umbriel {
namespace {

class Ground : public ModuleTest {
 protected:
    // Houses on open ground of two sides, 20 x 20 quads.
    void build(LightPlace place, ShadowMode mode) {
        ModuleTest::SetUp();
        block({-3, 0, -2}, {-1, 4, 0});
        block({1, 0, 1}, {4, 2, 2});
        block({0, 5, -1}, {1, 6, 3});
        finishScene(place, {2, 9, 5}, {0.4, -0.8, -0.3}, 1.2f);
        Mesh mesh = gridMesh(12.0f, 20);
        for (glm::vec3& position : mesh.positions) position = {position.x, 0.0f, -position.y};
        for (glm::vec3& normal : mesh.normals) normal = {0, 1, 0};
        ground = node(placed(lightNode, offset, glm::mat3(worldFromLocal)), geometry(mesh, material({1, 1, 1, 1})));
        blocks.push_back({{-12, -1e-9, -12}, {12, 0.0, 12}});  // for the rays
        look({2, 6, 14}, {0, 1, 0});
        scene->edit(viewport).set<&Viewport::shadowMode>(mode).set<&Viewport::mapSize>(512u);
    }
    // A box of a metre.
    void put(const glm::dvec3& at) {
        node(placed(lightNode, toWorld(at), glm::mat3(worldFromLocal)),
             geometry(boxMesh({0.5f, 0.5f, 0.5f}), material({1, 1, 1, 1})));
    }
    static constexpr PixelSize kWall{240, 150};
    static constexpr std::uint64_t kMostOfGround = 700;
    Ref<Node> ground;
};

TEST_F(Ground, IsNotDrawnAndChangesNothing) {
    for (const auto& [place, mode] :
         {std::pair(LightPlace::Directional, ShadowMode::Standard),
          {LightPlace::Directional, ShadowMode::LightSpacePerspective},
          {LightPlace::Directional, ShadowMode::Trapezoid},
          {LightPlace::Spot, ShadowMode::Standard},
          {LightPlace::Point, ShadowMode::Cube},
          {LightPlace::Point, ShadowMode::DualParaboloid}}) {
        SCOPED_TRACE(static_cast<int>(mode));
        build(place, mode);
        scene->edit(viewport).set<&Viewport::reuseMaps>(false);
        const WallViews views = resolved(kWall);
        const auto without = drawWall(views);
        EXPECT_LT(statistics.shadowTriangles, kMostOfGround);
        const Errors errors = errorsOf(without, kWall);
        EXPECT_GT(errors.dark, 200u);
        EXPECT_LT(errors.error, 0.03);
        // With something below, which the eye does not see, the same fits need the ground.
        put({0, -3, 0});
        const auto with = drawWall(views);
        EXPECT_GE(statistics.shadowTriangles, kMostOfGround);
        for (std::size_t i = 0; i < with.size(); ++i) EXPECT_EQ(differingPixels(without[i], with[i]), 0u) << names[i];
    }
}

TEST_F(Ground, DarkensWhatIsBelowIt) {
    build(LightPlace::Directional, ShadowMode::Standard);
    put({0, -3, 0});
    blocks.push_back({{-0.5, -3.5, -0.5}, {0.5, -2.5, 0.5}});
    look({2, -2.4, 4}, {0, -3, 0});
    const Errors errors = measure(kWall);
    EXPECT_GT(errors.dark, 1000u);
    EXPECT_LT(errors.error, 0.001);
}

TEST_F(Ground, IsDrawnOnceSomethingThatCastsNothingComesBelow) {
    build(LightPlace::Directional, ShadowMode::Standard);
    scene->edit(viewport).set<&Viewport::reuseMaps>(true).set<&Viewport::shadowFit>(ShadowFitMode::Scene);
    const auto lower = placed(lightNode, toWorld({0, 2, 0}), glm::mat3(worldFromLocal));
    node(lower, geometry(boxMesh({0.5f, 0.5f, 0.5f}), material({1, 1, 1, 1})));
    scene->edit(viewport).append<&Viewport::excludeNodes>(lower);
    const WallViews views = resolved(kWall);
    drawWall(views);
    EXPECT_LT(statistics.shadowTriangles, kMostOfGround);
    drawWall(views);
    EXPECT_EQ(statistics.shadowTriangles, 0u);
    const Node* found = scene->find(lower);
    scene->edit(Ref<Transform>(found->core.get().id)).set<&Transform::translation>(toWorld({0, -2, 0}));
    drawWall(views);
    EXPECT_GE(statistics.shadowTriangles, kMostOfGround);
    drawWall(views);
    EXPECT_EQ(statistics.shadowTriangles, 0u);
}

// Seen from below, a face that looks away from the light is wholly dark, though no map knows it.
TEST_F(Ground, IsDarkFromBelow) {
    build(LightPlace::Directional, ShadowMode::Standard);
    look({2, -5, 6}, {0, 0, 0});
    const auto images = drawWall(resolved(kWall));
    ASSERT_EQ(images.size(), 4u);
    std::size_t seen = 0;
    for (int y = 0; y < kWall.height; ++y)
        for (int x = 0; x < kWall.width; ++x) {
            if (images[2].at(x, y)[1] > -0.5f) continue;
            ++seen;
            EXPECT_EQ(images[3].at(x, y)[0], 0.0f) << x << ", " << y;
        }
    EXPECT_GT(seen, 1000u);
}

class PassedConstants : public ModuleTest {
 protected:
    WallImage drawnWith(ShadowMode mode, ReflectionModel model, std::vector<std::string> disabled) {
        rendererOptions.disabledWorkarounds = std::move(disabled);
        ModuleTest::SetUp();
        isOneGeometry = true;
        buildTown(30.0, 80);
        finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
        for (const ContainerId id : scene->ids())
            if (scene->findAs<Material>(id)) scene->edit(Ref<Material>(id)).set<&Material::model>(model);
        look({0, 4, 28}, {0, 1, 0});
        scene->edit(viewport).set<&Viewport::shadowMode>(mode).set<&Viewport::mapSize>(512u);
        return drawWall(resolved(kWall))[0];
    }
    static constexpr PixelSize kWall{240, 150};
};

// What comes from the vertices is what blocks hold. Places on maps and, of matt surfaces, the light's cosine are
// interpolated instead of computed: they differ by rounding, which decides at shadows' edges.
TEST_F(PassedConstants, DrawTheSamePicture) {
    for (const ReflectionModel model : {ReflectionModel::MetallicRoughness, ReflectionModel::BlinnPhong})
        for (const ShadowMode mode :
             {ShadowMode::None, ShadowMode::Standard, ShadowMode::LightSpacePerspective, ShadowMode::PercentageCloser}) {
            const WallImage passed = drawnWith(mode, model, {});
            const WallImage plain = drawnWith(mode, model, {"mesa-llvmpipe-gathers-constants"});
            const bool isMatt = model == ReflectionModel::BlinnPhong;
            const std::size_t most = mode == ShadowMode::None || mode == ShadowMode::PercentageCloser ? 0 : 8;
            EXPECT_LE(isMatt ? pixelsBeyondRounding(passed, plain) : differingPixels(passed, plain), most)
                << static_cast<int>(model) << ", " << static_cast<int>(mode);
        }
}

}  // namespace
}  // namespace umbriel
