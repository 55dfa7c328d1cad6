#include "client/app/light_map_scene.h"

#include "tests/shadows/shadow_fixture.h"

namespace umbriel {
namespace {

class LightMaps : public ModuleTest {
 protected:
    void bake(std::uint32_t size, const std::vector<std::string>& moving = {}) {
        scene->edit(viewport).set<&Viewport::shadowMode>(ShadowMode::LightMap);
        LightMapOptions options;
        options.size = size;
        const auto file = bakeLightMapOf(*scene, root, options, moving);
        ASSERT_TRUE(file) << file.error().message;
        const auto attached = attachLightMap(*scene, window, *file);
        ASSERT_TRUE(attached) << attached.error().message;
    }
    std::size_t fitsOf(ShadowMode mode) {
        std::size_t count = 0;
        const WallViews views = resolved({64, 64});
        for (const ShadowFit& fit : views.views[0].fits) count += fit.mode == mode ? 1 : 0;
        return count;
    }
};

TEST_F(LightMaps, ErrorFallsWithTheAtlasAndNoMapIsDrawn) {
    buildTown(30.0, 60);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    look({0, 12, 28}, {0, 1, 0});
    double last = 1.0;
    for (const std::uint32_t size : {256u, 512u, 1024u}) {
        bake(size);
        if (HasFatalFailure()) return;
        const Errors errors = measure();
        std::printf("light map %u: error %.3f %%, leak %.3f, acne %.3f, rmse %.3f\n", size, 100 * errors.error,
                    100 * errors.leak, 100 * errors.acne, errors.rmse);
        ASSERT_GT(errors.dark, 3000u);
        EXPECT_LT(errors.error, 0.75 * last);
        last = errors.error;
        EXPECT_EQ(statistics.shadowTriangles, 0u);
        EXPECT_GT(statistics.shadowMapBytes, std::uint64_t{size} * size);
        EXPECT_LT(statistics.shadowMapBytes, std::uint64_t{size} * size + 400000);
    }
    // Measured: 0.06 %; edges are straight where texels are as small as pixels.
    EXPECT_LT(last, 0.002);
    EXPECT_TRUE(warnings.empty());
    EXPECT_EQ(renderer->explain().find("shadow-map"), std::string::npos);
    EXPECT_NE(renderer->explain().find("light map 0: R8"), std::string::npos) << renderer->explain();
}

// Pages of 100 texels: seams cross the floor and the houses.
TEST_F(LightMaps, InPagesGiveThePictureOfOneTexture) {
    std::vector<WallImage> whole;
    for (const std::uint32_t page : {0xffffffffu, 100u}) {
        rendererOptions.largestLightMapPage = page;
        SetUp();
        if (HasFatalFailure()) return;
        buildTown(15.0, 25);
        const Ref<Node> top = root;
        const auto lamp = scene->create<PointLight>("lamp");
        scene->edit(lamp).set<&PointLight::beacon>(placed(root, toWorld({2, 14, 3})));
        root = node(root, lamp);
        finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
        root = top;
        look({0, 10, 16}, {0, 1, 0});
        bake(350);
        if (HasFatalFailure()) return;
        const auto images = drawWall(resolved({240, 150}));
        ASSERT_EQ(images.size(), 5u);
        EXPECT_EQ(statistics.shadowTriangles, 0u);
        const std::string plan = renderer->explain();
        if (page == 0xffffffffu) {
            EXPECT_NE(plan.find("R8 and charts 350x350 x2 "), std::string::npos) << plan;
            EXPECT_EQ(plan.find("light-map-pages"), std::string::npos) << plan;
            whole = images;
            continue;
        }
        EXPECT_NE(plan.find("light-map-pages"), std::string::npos) << plan;
        EXPECT_NE(plan.find("R8 and charts 89x89 x32 "), std::string::npos) << plan;
        for (std::size_t light = 3; light < 5; ++light) {
            std::size_t dark = 0, partly = 0;
            for (std::size_t i = 0; i < images[light].values.size(); ++i) {
                // Weights between texels have 8 bits.
                ASSERT_NEAR(images[light].values[i], whole[light].values[i], 1.5 / 256) << light << ": " << i;
                dark += images[light].values[i] < 0.5f ? 1 : 0;
                partly += images[light].values[i] > 0.1f && images[light].values[i] < 0.9f ? 1 : 0;
            }
            EXPECT_GT(dark, 1000u);
            EXPECT_GT(partly, 500u);
        }
    }
}

TEST_F(LightMaps, AreTrueForLampsAndSpotsToo) {
    for (const LightPlace place : {LightPlace::Point, LightPlace::Spot}) {
        SetUp();
        buildTown(15.0, 25);
        finishScene(place, {2, 14, 3}, {-0.1, -1.0, -0.1}, 0.9f);
        look({0, 10, 16}, {0, 1, 0});
        bake(1024);
        if (HasFatalFailure()) return;
        const Errors errors = measure();
        std::printf("light %d: error %.3f %%\n", static_cast<int>(place), 100 * errors.error);
        ASSERT_GT(errors.dark, 1000u);
        EXPECT_LT(errors.error, 0.003) << static_cast<int>(place);
    }
}

// Charts may be larger or smaller than a pixel, and with four samples a pixel's middle may lie beside its triangle.
TEST_F(LightMaps, TheFacesOfACubeAreDarkOrLitUpToTheirEdges) {
    block({-1, -1, -1}, {1, 1, 1});
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.3, -1.0, -0.4});
    for (const std::uint32_t size : {16u, 64u, 1024u}) {
        bake(size);
        if (HasFatalFailure()) return;
        for (const double distance : {2.5, 6.0, 40.0}) {
            look({0.6 * distance, 0.7 * distance, -0.7 * distance}, {0, 0, 0});
            WallViews views = resolved({200, 200});
            views.samples = 4;
            const auto images = drawWall(views);
            ASSERT_GE(images.size(), 4u);
            std::size_t dark = 0, lit = 0;
            for (std::size_t i = 0; i < images[3].values.size(); ++i) {
                const float* n = &images[2].values[i * images[2].channels];
                if (n[0] * n[0] + n[1] * n[1] + n[2] * n[2] < 0.5f) continue;
                const bool faces = glm::dot(glm::dvec3(n[0], n[1], n[2]), lightDirection) < 0.0;
                ASSERT_EQ(images[3].values[i], faces ? 1.0f : 0.0f) << size << " texels, " << distance << " m, " << i;
                ++(faces ? lit : dark);
            }
            EXPECT_GT(lit, 20u);
            EXPECT_GT(dark, 20u);
        }
    }
}

TEST_F(LightMaps, TilesAreBitEqualToOneServer) {
    buildTown(30.0, 60);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    look({0, 4, 28}, {0, 1, 0});
    bake(1024, {});
    if (HasFatalFailure()) return;
    // One of the houses moves, so that maps are drawn beside.
    const auto crate = geometry(boxMesh({1.5f, 1.5f, 1.5f}), material({1, 1, 1, 1}));
    const PixelSize wall{341, 227};
    for (const bool moving : {false, true}) {
        if (moving) node(placed(lightNode, toWorld({1, 3, 14})), crate);
        EXPECT_EQ(fitsOf(ShadowMode::Standard), moving ? 2u : 0u);
        for (const TileMode tiles : {TileMode::Exact, TileMode::Offset}) {
            const WallViews views = resolved(wall, tiles);
            const auto whole = drawWall(views);
            std::size_t dark = 0, lit = 0;
            for (const float factor : whole[3].values) {
                dark += factor < 0.5f;
                lit += factor > 0.5f;
            }
            EXPECT_GT(dark, 3000u);
            EXPECT_GT(lit, 3000u);
            expectEqualTiles(views, whole, {{2, 2}, {4, 4}});
        }
    }
}

// What moves casts onto what is in the map, and is darkened by it, by maps.
TEST_F(LightMaps, WhatMovesHasTrueShadowsBesideTheMap) {
    block({-20, -1, -20}, {20, 0, 20});
    block({-3, 0, -3}, {3, 8, 3});
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.7, -0.8, 0.1});
    look({4, 14, 22}, {3, 0, 0});
    scene->edit(viewport).set<&Viewport::mapSize>(2048u);
    bake(1024);
    if (HasFatalFailure()) return;
    EXPECT_EQ(fitsOf(ShadowMode::Standard), 0u);
    const Errors alone = measure();
    const auto moved = scene->create<Transform>();
    const Ref<Node> place = node(lightNode, moved);
    node(place, geometry(boxMesh({1, 1, 1}), material({1, 1, 1, 1})));
    blocks.push_back({});
    // In the sun, in the tower's shadow, and half of each.
    for (const glm::dvec3& at : {glm::dvec3(-8, 3, 4), glm::dvec3(7, 1.2, 0.5), glm::dvec3(6.2, 3.4, 3.4)}) {
        blocks.back() = {at - 1.0, at + 1.0};
        scene->edit(moved).set<&Transform::translation>(toWorld(at)).set<&Transform::linear>(glm::mat3(worldFromLocal));
        const Errors errors = measure();
        EXPECT_TRUE(warnings.empty());
        EXPECT_GT(statistics.shadowTriangles, 0u);
        EXPECT_LT(errors.error, alone.error + 0.004) << at.x;
        EXPECT_EQ(fitsOf(ShadowMode::LightMap), 1u);
    }
}

TEST_F(LightMaps, WhatIsStaleIsDrawnByTheStandardModule) {
    buildTown(30.0, 60);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    look({0, 12, 28}, {0, 1, 0});
    bake(1024);
    if (HasFatalFailure()) return;
    const auto pictures = [&](ShadowMode mode) {
        scene->edit(viewport).set<&Viewport::shadowMode>(mode);
        return drawWall(resolved({320, 200}));
    };
    const auto mapped = pictures(ShadowMode::LightMap);
    EXPECT_GT(differingPixels(mapped[3], pictures(ShadowMode::Standard)[3]), 100u);
    // A house walks.
    const Ref<Node> house = scene->get(lightNode).children[5];
    const Ref<Transform> walks(scene->get(house).core.get().id);
    scene->edit(walks).set<&Transform::translation>(scene->get(walks).translation.get() + glm::dvec3(1, 0, 0));
    const auto stale = pictures(ShadowMode::LightMap);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("is stale"), std::string::npos);
    const auto standard = pictures(ShadowMode::Standard);
    EXPECT_TRUE(warnings.empty());
    for (std::size_t i = 0; i < standard.size(); ++i) EXPECT_EQ(differingPixels(stale[i], standard[i]), 0u) << names[i];
    EXPECT_EQ(statistics.shadowMapBytes, 4u * 512 * 512);  // the light map's own are not there any more
}

// Half of a surface's triangles are drawn in another order than they were written in.
TEST_F(LightMaps, GeometriesWhoseTrianglesAreSortedFindTheirCharts) {
    Mesh dense = gridMesh(20.0f, 40);  // 3200 triangles: enough to be sorted
    const auto ground = scene->create<Geometry>();
    const glm::mat3 up(1, 0, 0, 0, 0, -1, 0, 1, 0);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.3, -1.0, 0.2});
    scene->edit(ground)
        .assign<&Geometry::positions>(dense.positions)
        .assign<&Geometry::normals>(dense.normals)
        .assign<&Geometry::indices>(dense.indices);
    node(placed(lightNode, offset, glm::mat3(worldFromLocal) * up), ground);
    for (int i = 0; i < 12; ++i) {
        const glm::dvec3 at(-15 + 10 * (i % 4), 0.0, -10 + 10 * (i / 4));
        blocks.push_back({at - glm::dvec3(1, 0, 1), at + glm::dvec3(1, 3, 1)});
        node(placed(lightNode, toWorld(at + glm::dvec3(0, 1.5, 0)), glm::mat3(worldFromLocal)),
             geometry(boxMesh({1, 1.5f, 1})));
    }
    look({0, 20, 25}, {0, 0, 0});
    bake(1024);
    if (HasFatalFailure()) return;
    const Errors errors = measure();
    std::printf("sorted: error %.3f %%\n", 100 * errors.error);
    ASSERT_GT(errors.dark, 2000u);
    EXPECT_LT(errors.error, 0.004);
    // Somebody else asks for the written order, in the very frame that draws.
    const auto glass = material({1, 1, 1, 0.5});
    scene->edit(glass).set<&Material::alphaMode>(AlphaMode::Blend);
    const auto group = scene->create<MaterialGroup>();
    scene->edit(group).set<&MaterialGroup::material>(Ref<Container>(glass.id));
    node(node(placed(lightNode, offset - glm::dvec3(0, 400, 0), glm::mat3(worldFromLocal) * up), group), ground);
    bake(1024);
    if (HasFatalFailure()) return;
    EXPECT_LT(measure().error, 0.008);
}

TEST_F(LightMaps, OfAnotherSceneAreRefused) {
    buildTown(10.0, 4);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    LightMapOptions options;
    options.size = 64;
    const auto file = bakeLightMapOf(*scene, root, options);
    ASSERT_TRUE(file);
    SetUp();
    buildTown(11.0, 4);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    const auto attached = attachLightMap(*scene, window, *file);
    ASSERT_FALSE(attached);
    EXPECT_EQ(attached.error().kind, Error::Kind::BadInput);
    EXPECT_NE(attached.error().message.find("another scene"), std::string::npos);
}

// A peer may send anything.
TEST_F(LightMaps, ThatDoNotFitTogetherAreNotLookedUp) {
    buildTown(10.0, 4);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    look({0, 6, 12}, {0, 1, 0});
    bake(64);
    if (HasFatalFailure()) return;
    const WallViews views = resolved({64, 48});
    const Ref<LightMap> map = scene->get(viewport).lightMap;
    const LightMap& whole = scene->get(map);
    const std::uint32_t place = whole.places[0];
    const auto drawn = [&] { return drawWall(views).size() >= 4; };
    scene->edit(map).setElement<&LightMap::places>(0, 0xfffffff0u);
    EXPECT_TRUE(drawn());
    scene->edit(map).setElement<&LightMap::places>(0, place).set<&LightMap::size>(63u);
    EXPECT_TRUE(drawn());
    scene->edit(map).set<&LightMap::size>(64u).resize<&LightMap::charts>(whole.charts.size() - 1);
    EXPECT_TRUE(drawn());
    scene->edit(map).resize<&LightMap::charts>(0).resize<&LightMap::places>(0).resize<&LightMap::surfaces>(0);
    EXPECT_TRUE(drawn());
    scene->edit(map).resize<&LightMap::lightStates>(0);
    EXPECT_TRUE(drawn());
}

}  // namespace
}  // namespace umbriel
