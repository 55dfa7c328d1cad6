#include <algorithm>

#include "tests/golden/draw_fixture.h"

namespace umbriel {
namespace {

constexpr PixelSize kOdd{341, 227};

class TilesTest : public DrawTest {
 protected:
    // Textures with mips, a normal map, blending, holes, three kinds of lights, two shadow maps, text.
    View busyScene(PixelSize wall) {
        const auto sun = scene->create<DirectionalLight>("sun");
        const glm::vec3 travels(-0.5f, -1.0f, -0.4f);
        const auto spot = scene->create<SpotLight>("spot");
        const Ref<Node> spotBeacon = placed(root, {0, 5, 0}, lookingAlong({0.01f, -1, 0}));
        scene->edit(spot)
            .set<&SpotLight::intensity>(glm::vec3(20, 10, 5))
            .set<&SpotLight::beacon>(spotBeacon)
            .set<&SpotLight::innerAngle>(0.5f)
            .set<&SpotLight::outerAngle>(0.7f);
        const auto point = scene->create<PointLight>("lamp");
        const Ref<Node> pointBeacon = placed(root, {-3, 1.5, 2});
        scene->edit(point).set<&PointLight::intensity>(glm::vec3(2, 2, 6)).set<&PointLight::beacon>(pointBeacon);
        const Ref<Node> all = node(node(lit(root, sun, travels, glm::vec3(2.5f)), spot), point);
        const auto texture = checkerTexture(128);
        const auto bumps = checkerTexture(64);
        const auto floor = material({0.8f, 0.8f, 0.8f, 1});
        scene->edit(floor).set<&Material::baseColourTexture>(texture);
        const auto metal = material({1, 0.9f, 0.8f, 1}, ReflectionModel::MetallicRoughness);
        scene->edit(metal)
            .set<&Material::baseColourTexture>(texture)
            .set<&Material::roughness>(0.35f)
            .set<&Material::metallic>(0.5f)
            .set<&Material::normalTexture>(bumps)
            .set<&Material::normalScale>(0.3f);
        const glm::mat3 flat(glm::rotate(glm::mat4(1), -1.5707963f, glm::vec3(1, 0, 0)));
        Mesh ground = gridMesh(10.0f, 24);
        for (glm::vec2& uv : ground.texCoords) uv *= 6.0f;
        node(placed(all, {0, 0, 0}, flat), geometry(ground, floor));
        const auto box = geometry(boxMesh({0.5f, 0.7f, 0.5f}), metal);
        for (int i = 0; i < 9; ++i)
            node(placed(all, {-3.0 + 0.77 * i, 0.7 + 0.05 * i, -2.0 + 1.3 * (i % 3)},
                        glm::mat3(glm::rotate(glm::mat4(1), 0.4f * float(i), glm::vec3(0.2f, 1, 0)))),
                 box);
        for (int i = 0; i < 3; ++i) {
            const auto glass = material({0.3f * float(i), 0.8f, 0.4f, 0.4f});
            scene->edit(glass).set<&Material::alphaMode>(AlphaMode::Blend).set<&Material::doubleSided>(true);
            node(placed(all, {-1.0 + i, 1.0, 2.5 - 0.6 * i}), geometry(gridMesh(0.8f, 3), glass));
        }
        const auto leaf = material({0.2f, 0.9f, 0.2f, 1});
        std::vector<std::uint8_t> dots;
        for (int i = 0; i < 32 * 32; ++i)
            dots.insert(dots.end(), {255, 255, 255, std::uint8_t((i % 8 < 4) == (i / 32 % 8 < 4) ? 255 : 0)});
        scene->edit(leaf)
            .set<&Material::baseColourTexture>(checkerTexture(32, dots))
            .set<&Material::alphaMode>(AlphaMode::Mask)
            .set<&Material::doubleSided>(true);
        node(placed(all, {2, 1.5, 1}), geometry(gridMesh(0.9f, 2), leaf));
        const auto background = scene->create<GradientBackground>();
        scene->edit(background)
            .set<&GradientBackground::bottom>(glm::vec4(0.3f, 0.3f, 0.4f, 1))
            .set<&GradientBackground::top>(glm::vec4(0.1f, 0.2f, 0.6f, 1));
        const auto text = scene->create<TextForeground>();
        scene->edit(text).set<&TextForeground::text>("wall").set<&TextForeground::lowerLeft>(glm::vec2(0.4f, 0.5f));
        scene->edit(viewport)
            .set<&Viewport::background>(Ref<Container>(background.id))
            .append<&Viewport::foregrounds>(Ref<Container>(text.id));
        View view = lookAt({3.3, 3.1, 6.7}, {0, 0.6, 0}, 0.8, wall);
        ShadowFit spotFit;
        spotFit.light = spot.id;
        spotFit.mode = ShadowMode::Standard;
        spotFit.mapSize = 300;
        spotFit.perspective = true;
        const double f = 1.0 / std::tan(0.72);
        glm::dmat4 clipFromLight(0.0);
        clipFromLight[0][0] = clipFromLight[1][1] = f;
        clipFromLight[2][3] = -1.0;
        clipFromLight[3][2] = 0.1;
        spotFit.worldFromLight = glm::dmat3(lookingAlong({0.01f, -1, 0}));
        spotFit.positionWorld = {0, 5, 0};
        spotFit.clipFromWorld = clipFromLight * glm::dmat4(glm::transpose(spotFit.worldFromLight)) *
                                glm::translate(glm::dmat4(1.0), -spotFit.positionWorld);
        spotFit.texelSize = 2 / f / 300;
        spotFit.normalOffset = 0.5f;
        view.fits = {fitSphere(sun.id, travels, {0, 0, 0}, 14, 700), spotFit};
        return view;
    }
    struct Difference {
        std::size_t differing = 0, over8 = 0, holes = 0;
    };
    static Difference compare(const WallImage& a, const WallImage& b) {
        Difference difference;
        for (std::size_t i = 0; i + 3 < a.values.size(); i += 4) {
            int largest = 0;
            for (std::size_t c = 0; c < 3; ++c)
                largest = std::max(largest, std::abs(encoded(a.values[i + c]) - encoded(b.values[i + c])));
            difference.differing += largest > 0;
            difference.over8 += largest > 8;
            difference.holes += (a.values[i + 3] == 0.0f) != (b.values[i + 3] == 0.0f);
        }
        return difference;
    }
};

TEST_F(TilesTest, ExactTilesAreBitEqualToTheWholeWall) {
    const View view = busyScene(kOdd);
    for (const std::uint32_t samples : {1u, 4u}) {
        const WallViews views = wallViews(view, TileMode::Exact, samples, 0x3f);
        const auto whole = drawWall(views);
        ASSERT_EQ(whole.size(), 8u);
        SCOPED_TRACE(samples);
        expectEqualTiles(views, whole, {{2, 2}, {3, 1}, {5, 3}});
    }
}

TEST_F(TilesTest, TilesAreBitEqualInEveryPrecisionOfColours) {
    const View view = busyScene(kOdd);
    for (const ColourPrecision precision : {ColourPrecision::Half, ColourPrecision::Byte})
        for (const TileMode mode : {TileMode::Exact, TileMode::Offset})
            for (const std::uint32_t samples : {1u, 4u}) {
                WallViews views = wallViews(view, mode, samples);
                views.colourPrecision = precision;
                SCOPED_TRACE(samples);
                expectEqualTiles(views, drawWall(views), {{2, 2}, {5, 3}});
            }
}

// With everything blended, resolved and shaded, a picture of half floats shows as that of floats: one level apart here
// and there, where a value lies near the border of two.
TEST_F(TilesTest, HalfFloatsShowAsFloatsDo) {
    const View view = busyScene(kOdd);
    for (const std::uint32_t samples : {1u, 4u}) {
        WallViews views = wallViews(view, TileMode::Exact, samples);
        const WallImage whole = drawColour(views);
        views.colourPrecision = ColourPrecision::Half;
        const WallImage half = drawColour(views);
        std::size_t differing = 0;
        for (std::size_t i = 0; i < whole.values.size(); ++i) {
            const int apart = std::abs(encoded(whole.values[i]) - encoded(half.values[i]));
            ASSERT_LE(apart, 1) << whole.values[i] << ", " << half.values[i];
            differing += apart > 0;
        }
        // A step is at most a ninth of a level, and some pixels are rounded four times over.
        EXPECT_LE(differing, whole.values.size() / 5);
        RecordProperty("differing", static_cast<int>(differing));
    }
}

TEST_F(TilesTest, SeveralTilesOfOneServerAreTheSameAsOneEach) {
    const View view = busyScene(kOdd);
    for (const TileMode mode : {TileMode::Exact, TileMode::Offset}) {
        const WallViews views = wallViews(view, mode, 1, 0x3f);
        const auto apart = drawWall(views, 3, 2);
        const auto together = drawWall(views, 3, 2, true);
        ASSERT_EQ(apart.size(), together.size());
        for (std::size_t i = 0; i < apart.size(); ++i) EXPECT_EQ(differingPixels(apart[i], together[i]), 0u) << i;
    }
}

TEST_F(TilesTest, TwoRunsAreBitEqual) {
    const View view = busyScene(kOdd);
    const WallViews views = wallViews(view, TileMode::Offset, 4);
    EXPECT_EQ(differingPixels(drawColour(views, 2, 2), drawColour(views, 2, 2)), 0u);
}

// Blocks of the wall have window coordinates of their own, so a grid of tiles changes nothing; the product's limits
// (0.05 % of the pixels in 8 bits) are those against a wall drawn in one piece.
TEST_F(TilesTest, OffsetTilesAreBitEqualToo) {
    const PixelSize wall{1277, 719};
    const View view = busyScene(wall);
    const WallViews views = wallViews(view, TileMode::Offset, 1, 0x3f);
    const auto whole = drawWall(views);
    ASSERT_EQ(whole.size(), 8u);
    expectEqualTiles(views, whole, {{2, 2}, {5, 3}});
    const Difference difference = compare(whole[0], drawColour(wallViews(view, TileMode::Exact)));
    EXPECT_LE(difference.differing, static_cast<std::size_t>(wall.width * wall.height / 2000));
    EXPECT_LE(difference.over8, 5u);
    EXPECT_EQ(difference.holes, 0u);
}

TEST_F(TilesTest, TilesOfOnePixelWork) {
    const PixelSize wall{7, 5};
    const View view = busyScene(wall);
    const WallViews views = wallViews(view, TileMode::Exact);
    EXPECT_EQ(differingPixels(drawColour(views), drawColour(views, 7, 5)), 0u);
    const Difference difference = compare(drawColour(views), drawColour(wallViews(view, TileMode::Offset), 7, 5));
    EXPECT_EQ(difference.holes, 0u);
}

TEST_F(TilesTest, AWallBeyondTheViewportLimitIsDrawnThroughACrop) {
    const PixelSize wall{20000, 12000};
    const View view = busyScene(wall);
    sync();
    WallViews views = wallViews(view, TileMode::Offset);
    // The same place on a wall a hundredth as fine says what must be there.
    const PixelSize coarse{200, 120};
    View coarseView = view;
    coarseView.region = {0, 0, coarse.width, coarse.height};
    const WallImage expected = drawColour(wallViews(coarseView, TileMode::Offset));
    for (const glm::ivec2 corner :
         {glm::ivec2(0, 0), glm::ivec2(19900, 11900), glm::ivec2(10000, 6000), glm::ivec2(17000, 2000)}) {
        TileAssignment tile;
        tile.pixels = {corner.x, corner.y, 100, 100};
        auto drawn = renderer->draw(*scene, views, {&tile, 1}, 0.0);
        ASSERT_TRUE(drawn) << drawn.error().message;
        auto read = renderer->readTiles();
        ASSERT_TRUE(read);
        const float* middle = reinterpret_cast<const float*>((*read)[0].layers[0].pixels.data()) + (50 * 100 + 50) * 4;
        const float* wanted = expected.at(corner.x / 100, corner.y / 100);
        // Both pixels' centres lie within half a fine pixel; texture detail differs by the choice of mip.
        EXPECT_NEAR(middle[3], wanted[3], 1e-6f);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(middle[c], wanted[c], 0.25f) << corner.x << "," << corner.y;
    }
    views.tiles = TileMode::Exact;
    TileAssignment tile;
    tile.pixels = {0, 0, 100, 100};
    const auto refused = renderer->draw(*scene, views, {&tile, 1}, 0.0);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, Error::Kind::BadInput);
    EXPECT_NE(refused.error().message.find("20000x12000"), std::string::npos) << refused.error().message;
}

// No cheating: what sixteen servers draw together against what one draws.
TEST_F(TilesTest, SixteenServersDrawLittleMoreThanOne) {
    const auto sun = scene->create<DirectionalLight>();
    const glm::vec3 travels(-0.5f, -1.0f, -0.4f);
    const Ref<Node> all = lit(root, sun, travels, glm::vec3(2.5f));
    const glm::mat3 flat(glm::rotate(glm::mat4(1), -1.5707963f, glm::vec3(1, 0, 0)));
    node(placed(all, {0, 0, 0}, flat), geometry(gridMesh(300.0f, 128), material({0.5f, 0.5f, 0.5f, 1})));
    const auto house = geometry(boxMesh({3, 5, 3}), material({0.8f, 0.7f, 0.6f, 1}));
    for (int i = 0; i < 2000; ++i) node(placed(all, {-290.0 + 13.0 * (i % 45), 5.0, -290.0 + 13.0 * (i / 45)}), house);
    const PixelSize wall{640, 360};
    View view = lookAt({-160, 260, 520}, {0, 0, 0}, 0.8, wall);
    view.fits = {fitSphere(sun.id, travels, {0, 0, 0}, 430, 1024)};
    const WallImage whole = drawColour(wallViews(view));
    const DrawStatistics one = statistics;
    const WallImage tiled = drawColour(wallViews(view), 4, 4);
    EXPECT_EQ(differingPixels(whole, tiled), 0u);
    EXPECT_LE(double(statistics.triangles), 1.3 * double(one.triangles))
        << one.triangles << " (" << one.shadowTriangles << " in shadow maps) against " << statistics.triangles << " ("
        << statistics.shadowTriangles << ")";
    RecordProperty("one", static_cast<int>(one.triangles));
    RecordProperty("sixteen", static_cast<int>(statistics.triangles));
}

}  // namespace
}  // namespace umbriel
