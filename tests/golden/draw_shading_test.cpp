#include "tests/golden/draw_fixture.h"

namespace umbriel {
namespace {

constexpr float kPi = 3.14159265f;
constexpr PixelSize kSmall{64, 48};

class ShadingTest : public DrawTest {
 protected:
    // The plane z = 0, seen straight on, 4 m wide.
    Ref<Node> plane(Ref<Node> parent, Ref<Material> of) { return node(parent, geometry(gridMesh(5.0f), of)); }
    glm::vec3 middleOf(const WallImage& image) const {
        const float* pixel = image.at(image.size.width / 2, image.size.height / 2);
        return {pixel[0], pixel[1], pixel[2]};
    }
};

// 1e-5 relative: a dozen float operations; cos of the light's angle comes from a float 3x3 matrix.
constexpr float kFloatTolerance = 1e-5f;

TEST_F(ShadingTest, ADirectionalLightOnAMattePlaneGivesAlbedoOverPiTimesIrradianceTimesCosine) {
    for (const float angle : {0.0f, 0.5f, 1.2f}) {
        SetUp();
        const auto light = scene->create<DirectionalLight>();
        const glm::vec3 travels(std::sin(angle), 0.0f, -std::cos(angle));
        plane(lit(root, light, travels, {2.0f, 3.0f, 4.0f}), material({0.5f, 0.25f, 0.125f, 1.0f}));
        const WallImage image = drawColour(wallViews(flatView(4.0, kSmall)));
        ASSERT_FALSE(image.values.empty());
        const glm::vec3 expected = glm::vec3(0.5f, 0.25f, 0.125f) * glm::vec3(2, 3, 4) * std::cos(angle) / kPi;
        for (int channel = 0; channel < 3; ++channel)
            EXPECT_NEAR(middleOf(image)[channel], expected[channel], expected[channel] * kFloatTolerance) << angle;
        EXPECT_EQ(image.at(3, 3)[3], 1.0f);
    }
}

TEST_F(ShadingTest, APointLightFallsWithTheSquareOfTheDistanceAndTheCosine) {
    const auto light = scene->create<PointLight>();
    const Ref<Node> beacon = placed(root, {0, 0, 2});
    scene->edit(light).set<&PointLight::intensity>(glm::vec3(5.0f)).set<&PointLight::beacon>(beacon);
    plane(node(root, light), material({1, 1, 1, 1}));
    const WallImage image = drawColour(wallViews(flatView(4.0, kSmall)));
    ASSERT_FALSE(image.values.empty());
    for (const int x : {2, 20, 40, 60}) {
        const double metres = (x + 0.5) / 64 * 4 - 2;
        const double up = 0.5 / 48 * 3;  // the row just above the middle
        const double squared = metres * metres + up * up + 4.0;
        const double expected = 5.0 / squared * (2.0 / std::sqrt(squared)) / static_cast<double>(kPi);
        EXPECT_NEAR(image.at(x, 24)[0], expected, expected * 2e-5) << x;
    }
}

TEST_F(ShadingTest, ASpotLightIsBlackOutsideItsConeAndFullInside) {
    const auto light = scene->create<SpotLight>();
    const Ref<Node> beacon = placed(root, {0, 0, 2});
    scene->edit(light)
        .set<&SpotLight::intensity>(glm::vec3(4.0f))
        .set<&SpotLight::beacon>(beacon)
        .set<&SpotLight::innerAngle>(0.3f)
        .set<&SpotLight::outerAngle>(0.5f);
    plane(node(root, light), material({1, 1, 1, 1}));
    const WallImage image = drawColour(wallViews(flatView(4.0, kSmall)));
    ASSERT_FALSE(image.values.empty());
    EXPECT_NEAR(middleOf(image).x, 4.0f / 4.0f / kPi, 1e-3f);  // half a pixel off the axis
    EXPECT_EQ(image.at(1, 24)[0], 0.0f);                       // atan(1.95 / 2) = 0.77 rad
}

TEST_F(ShadingTest, UnlitIsItsColourExactly) {
    plane(root, material({0.25f, 0.5f, 0.75f, 1.0f}, ReflectionModel::Unlit));
    const WallImage image = drawColour(wallViews(flatView(4.0, kSmall)));
    ASSERT_FALSE(image.values.empty());
    EXPECT_EQ(middleOf(image), glm::vec3(0.25f, 0.5f, 0.75f));
}

TEST_F(ShadingTest, LightActsBelowItsNodeOnly) {
    const auto light = scene->create<DirectionalLight>();
    const Ref<Node> below = lit(root, light, {0, 0, -1});
    node(placed(below, {-1, 0, 0}), geometry(gridMesh(0.5f), material({1, 1, 1, 1})));
    node(placed(root, {1, 0, 0}), geometry(gridMesh(0.5f), material({1, 1, 1, 1})));
    const WallImage image = drawColour(wallViews(flatView(4.0, kSmall)));
    ASSERT_FALSE(image.values.empty());
    EXPECT_GT(image.at(16, 24)[0], 0.3f);
    EXPECT_EQ(image.at(48, 24)[0], 0.0f);
    EXPECT_EQ(image.at(48, 24)[3], 1.0f);
    EXPECT_EQ(image.at(32, 24)[3], 0.0f);  // nothing there: no coverage
}

TEST_F(ShadingTest, OneGeometryOnTwoNodesIsUploadedOnce) {
    const auto shared = geometry(boxMesh(glm::vec3(0.3f)), material({1, 0, 0, 1}, ReflectionModel::Unlit));
    node(placed(root, {-1, 0, 0}), shared);
    node(placed(root, {1, 0, 0}), shared);
    const WallImage image = drawColour(wallViews(flatView(4.0, kSmall)));
    ASSERT_FALSE(image.values.empty());
    EXPECT_EQ(image.at(16, 24)[0], 1.0f);
    EXPECT_EQ(image.at(48, 24)[0], 1.0f);
    EXPECT_EQ(statistics.triangles, 24u);
}

TEST_F(ShadingTest, AMirroredSurfaceKeepsItsOutside) {
    const auto light = scene->create<DirectionalLight>();
    const Ref<Node> below = lit(root, light, {0, 0, -1}, glm::vec3(kPi));
    // Mirrored in x: the winding turns, what faces the viewer still does.
    plane(placed(below, {0, 0, 0}, glm::mat3(-1, 0, 0, 0, 1, 0, 0, 0, 1)), material({0.5f, 0.5f, 0.5f, 1}));
    WallImage image = drawColour(wallViews(flatView(4.0, kSmall)));
    ASSERT_FALSE(image.values.empty());
    EXPECT_NEAR(middleOf(image).x, 0.5f, 1e-5f);
    // Turned round: a single-sided surface has no back.
    SetUp();
    const auto second = scene->create<DirectionalLight>();
    plane(placed(lit(root, second, {0, 0, -1}, glm::vec3(kPi)), {0, 0, 0}, glm::mat3(-1, 0, 0, 0, 1, 0, 0, 0, -1)),
          material({0.5f, 0.5f, 0.5f, 1}));
    image = drawColour(wallViews(flatView(4.0, kSmall)));
    EXPECT_EQ(image.at(32, 24)[3], 0.0f);
}

TEST_F(ShadingTest, ADoubleSidedBackIsLitLikeAFront) {
    const auto light = scene->create<DirectionalLight>();
    const auto both = material({0.5f, 0.5f, 0.5f, 1});
    scene->edit(both).set<&Material::doubleSided>(true);
    plane(placed(lit(root, light, {0, 0, -1}, glm::vec3(kPi)), {0, 0, 0}, glm::mat3(-1, 0, 0, 0, 1, 0, 0, 0, -1)),
          both);
    const WallImage image = drawColour(wallViews(flatView(4.0, kSmall)));
    ASSERT_FALSE(image.values.empty());
    EXPECT_NEAR(middleOf(image).x, 0.5f, 1e-5f);
}

TEST_F(ShadingTest, WithoutNormalsTheFaceNormalShades) {
    const auto light = scene->create<DirectionalLight>();
    Mesh mesh = boxMesh(glm::vec3(1.0f));
    mesh.normals.clear();
    const glm::mat3 turned(glm::rotate(glm::mat4(1.0f), 0.6f, glm::vec3(0, 1, 0)));
    node(placed(lit(root, light, {0, 0, -1}, glm::vec3(kPi)), {0, 0, 0}, turned),
         geometry(mesh, material({1, 1, 1, 1})));
    const WallImage image = drawColour(wallViews(flatView(4.0, kSmall)));
    ASSERT_FALSE(image.values.empty());
    // The box's +z face is turned by 0.6 rad; its -x face comes into view at the left, turned by pi/2 - 0.6.
    EXPECT_NEAR(image.at(36, 24)[0], std::cos(0.6f), 1e-5f);
    EXPECT_NEAR(image.at(13, 24)[0], std::sin(0.6f), 1e-5f);
}

TEST_F(ShadingTest, AlphaMaskCutsAndBlendMixesBackToFront) {
    plane(root, material({1, 0, 0, 1}, ReflectionModel::Unlit));
    const auto glass = [&](glm::vec4 colour) {
        const auto made = material(colour, ReflectionModel::Unlit);
        scene->edit(made).set<&Material::alphaMode>(AlphaMode::Blend);
        return made;
    };
    // Made front first, so that the order is not that of creation.
    node(placed(root, {0, 0, 2}), geometry(gridMesh(0.5f), glass({0, 0, 1, 0.5f})));
    node(placed(root, {0, 0, 1}), geometry(gridMesh(0.5f), glass({0, 1, 0, 0.5f})));
    const auto cut = material({1, 1, 1, 1}, ReflectionModel::Unlit);
    scene->edit(cut).set<&Material::alphaMode>(AlphaMode::Mask).set<&Material::alphaCutoff>(0.6f);
    Mesh faded = gridMesh(0.5f);
    faded.colours = {{1, 1, 1, 0.2f}, {1, 1, 1, 1.0f}, {1, 1, 1, 0.2f}, {1, 1, 1, 1.0f}};
    node(placed(root, {1.5, 0, 1}), geometry(faded, cut));
    const WallImage image = drawColour(wallViews(flatView(4.0, kSmall)));
    ASSERT_FALSE(image.values.empty());
    const float* mixed = image.at(32, 24);
    EXPECT_FLOAT_EQ(mixed[0], 0.25f);
    EXPECT_FLOAT_EQ(mixed[1], 0.25f);
    EXPECT_FLOAT_EQ(mixed[2], 0.5f);
    EXPECT_FLOAT_EQ(mixed[3], 1.0f);
    // The quad spans x 48..64; its alpha passes 0.6 in the middle, at x = 56.
    EXPECT_EQ(image.at(54, 24)[1], 0.0f);
    EXPECT_EQ(image.at(58, 24)[1], 1.0f);
}

TEST_F(ShadingTest, TexturesDecodeSRgbAndShowTheirFirstRowAtVZero) {
    // 2x2: first row white and black, second row red and mid-grey (code 188 is 0.5 in linear light).
    const auto texture = checkerTexture(2, {255, 255, 255, 255, 0, 0, 0, 255, 255, 0, 0, 255, 188, 188, 188, 255});
    scene->edit(texture)
        .set<&Texture::magFilter>(FilterMode::Nearest)
        .set<&Texture::mipMode>(MipMode::None)
        .set<&Texture::minFilter>(FilterMode::Nearest);
    const auto textured = material({1, 1, 1, 1}, ReflectionModel::Unlit);
    scene->edit(textured).set<&Material::baseColourTexture>(texture);
    node(root, geometry(gridMesh(2.0f), textured));
    const WallImage image = drawColour(wallViews(flatView(4.0, {64, 64})));
    ASSERT_FALSE(image.values.empty());
    EXPECT_EQ(image.at(10, 10)[0], 1.0f);  // v = 0 is at the bottom of this mesh
    EXPECT_EQ(image.at(50, 10)[0], 0.0f);
    EXPECT_EQ(image.at(10, 50)[1], 0.0f);
    EXPECT_NEAR(image.at(50, 50)[0], 0.5029f, 1e-3f);
}

TEST_F(ShadingTest, ANormalMapWithDerivedTangentsTurnsTheNormal) {
    // Texel (0.5 + 0.5 sin, 0.5, 0.5 + 0.5 cos) with an angle of atan2(127, 127) = 45 degrees towards +u.
    const std::uint8_t half = std::uint8_t(std::lround(255 * (0.5 + 0.5 * std::sqrt(0.5))));
    const auto texture = checkerTexture(1, {half, 128, half, 255});
    const auto mapped = material({1, 1, 1, 1});
    scene->edit(mapped).set<&Material::normalTexture>(texture);
    const auto light = scene->create<DirectionalLight>();
    node(lit(root, light, {-1, 0, 0}, glm::vec3(kPi)), geometry(gridMesh(2.0f), mapped));
    const WallImage image = drawColour(wallViews(flatView(4.0, kSmall)));
    ASSERT_FALSE(image.values.empty());
    // The light grazes the plane and comes from +x, where u grows. 8-bit texels: 1/255 of the normal.
    EXPECT_NEAR(middleOf(image).x, std::sqrt(0.5f), 0.008f);
}

TEST_F(ShadingTest, AnEmptySceneIsItsBackground) {
    const auto background = scene->create<GradientBackground>();
    scene->edit(background)
        .set<&GradientBackground::bottom>(glm::vec4(0, 0, 0, 1))
        .set<&GradientBackground::top>(glm::vec4(1));
    scene->edit(viewport).set<&Viewport::background>(Ref<Container>(background.id));
    const WallImage image = drawColour(wallViews(flatView(4.0, kSmall)));
    ASSERT_FALSE(image.values.empty());
    for (const int y : {0, 20, 47}) EXPECT_NEAR(image.at(5, y)[0], (y + 0.5f) / 48, 1e-6f);
    EXPECT_EQ(statistics.triangles, 0u);
    EXPECT_EQ(renderer->explain().find("shadow"), std::string::npos);
}

TEST_F(ShadingTest, AMillionMetresFromTheOriginLooksTheSame) {
    const auto build = [&](glm::dvec3 offset) {
        SetUp();
        const auto light = scene->create<DirectionalLight>();
        const glm::vec3 travels(-0.5f, -0.3f, -1.0f);
        const Ref<Node> all = placed(lit(root, light, travels, glm::vec3(3.0f)), offset);
        node(all, geometry(gridMesh(5.0f), material({0.5f, 0.6f, 0.7f, 1})));
        node(placed(all, {0.3, 0.2, 0.5}), geometry(boxMesh(glm::vec3(0.4f)), material({0.9f, 0.3f, 0.3f, 1})));
        View view = lookAt(offset + glm::dvec3(2, 1, 4), offset, 0.9, {97, 61});
        view.fits = {fitSphere(light.id, travels, offset, 8, 256)};
        return drawColour(wallViews(view));
    };
    const WallImage here = build({0, 0, 0});
    const WallImage there = build({1e6, -1e6, 1e6});
    ASSERT_EQ(here.values.size(), there.values.size());
    // Exactly representable offsets: nothing but the light's double matrix may round differently, in its last bits.
    std::size_t visible = 0;
    for (std::size_t i = 0; i < here.values.size(); ++i) visible += encoded(here.values[i]) != encoded(there.values[i]);
    EXPECT_LE(visible, 3u);  // a shadow edge may fall on the other side of a texel
}

TEST_F(ShadingTest, LayersSayWhatIsThere) {
    const auto light = scene->create<DirectionalLight>("sun");
    const Ref<Node> below = lit(root, light, {0, 0, -1});
    Mesh mesh = gridMesh(1.0f, 32);  // 2048 triangles: reordered when uploaded
    const Ref<Node> plate = node(placed(below, {0, 0, 3}), geometry(mesh, material({1, 1, 1, 1})));
    const std::uint32_t everything = 0x3f;
    const View view = lookAt({0, 0, 5}, {0, 0, 0}, 1.0, {65, 65});
    const auto layers = drawWall(wallViews(view, TileMode::Exact, 1, everything));
    ASSERT_EQ(layers.size(), 6u);
    EXPECT_EQ(names, (std::vector<std::string>{"colour", "depth", "position", "normal", "ids", "light.sun"}));
    EXPECT_NEAR(layers[1].at(32, 32)[0], 2.0f, 1e-5f);
    EXPECT_EQ(layers[1].at(0, 0)[0], 0.0f);
    EXPECT_NEAR(layers[2].at(32, 32)[2], -2.0f, 1e-5f);
    EXPECT_EQ(layers[3].at(40, 32)[2], 1.0f);
    EXPECT_EQ(layers[4].bits(0, 0, 0), 0xffffffffu);
    EXPECT_EQ(layers[5].at(32, 32)[0], 1.0f);
    // The triangle's number, from the position: a wall 2 m away is 2 * 2 * tan(0.5) m wide.
    for (const int x : {12, 25, 33, 50})
        for (const int y : {10, 32, 47}) {
            EXPECT_EQ(layers[4].bits(x, y, 0), static_cast<std::uint32_t>(plate.id.value));
            const glm::vec2 place(layers[2].at(x, y)[0], layers[2].at(x, y)[1]);
            const glm::vec2 cell = (place + 1.0f) * 16.0f;
            const glm::vec2 within = glm::fract(cell);
            if (std::abs(within.x - within.y) < 0.05f) continue;  // on the diagonal
            const int quad = int(cell.y) * 32 + int(cell.x);
            EXPECT_EQ(layers[4].bits(x, y, 1), static_cast<std::uint32_t>(quad * 2 + (within.y > within.x ? 1 : 0)));
        }
}

TEST_F(ShadingTest, DegenerateDataDoesNotHurt) {
    Mesh mesh = gridMesh(1.0f, 2);
    mesh.positions[1].x = std::numeric_limits<float>::quiet_NaN();
    mesh.positions[2].y = std::numeric_limits<float>::infinity();
    mesh.indices[4] = 4000000000u;
    mesh.indices.push_back(1);  // two thirds of a triangle missing
    const auto light = scene->create<DirectionalLight>();
    const Ref<Node> below = lit(root, light, {0, 0, -1});
    node(below, geometry(mesh));
    node(below, geometry({}));
    node(placed(below, {0, 0, 0}, glm::mat3(0.0f)), geometry(gridMesh(1.0f)));
    const WallImage image = drawColour(wallViews(flatView(4.0, kSmall)));
    ASSERT_FALSE(image.values.empty());
    for (const float value : image.values) ASSERT_TRUE(std::isfinite(value));
}

TEST_F(ShadingTest, AChangeShowsAndCostsWhatChanged) {
    const auto plate = geometry(gridMesh(1.0f, 2), material({1, 0, 0, 1}, ReflectionModel::Unlit));
    const Ref<Transform> move = scene->create<Transform>();
    node(node(root, move), plate);
    const WallViews views = wallViews(flatView(8.0, kSmall));
    EXPECT_EQ(drawColour(views).at(32, 24)[3], 1.0f);
    scene->edit(move).set<&Transform::translation>(glm::dvec3(3, 0, 0));
    WallImage image = drawColour(views);
    EXPECT_EQ(image.at(32, 24)[3], 0.0f);
    EXPECT_EQ(image.at(56, 24)[3], 1.0f);
    // A quad pulled out is drawn there, and culling knows.
    scene->edit(plate).setElement<&Geometry::positions>(0, glm::vec3(-6.5f, -1, 0));
    scene->edit(plate).setElement<&Geometry::positions>(3, glm::vec3(-6.5f, 0, 0));
    image = drawColour(views);
    EXPECT_EQ(image.at(8, 20)[3], 1.0f);
}

TEST_F(ShadingTest, ForegroundsAreDrawnInWallCoordinates) {
    const auto text = scene->create<TextForeground>();
    scene->edit(text)
        .set<&TextForeground::text>("I")
        .set<&TextForeground::height>(16.0f)
        .set<&TextForeground::lowerLeft>(glm::vec2(20, 8))
        .set<&TextForeground::colour>(glm::vec4(0, 1, 0, 1));
    scene->edit(viewport).append<&Viewport::foregrounds>(Ref<Container>(text.id));
    const WallImage image = drawColour(wallViews(flatView(4.0, kSmall)));
    ASSERT_FALSE(image.values.empty());
    // An I: the third of six columns, two pixels wide each; the eighth row of the cell is empty.
    EXPECT_EQ(image.at(24, 16)[1], 1.0f);
    EXPECT_EQ(image.at(25, 16)[1], 1.0f);
    EXPECT_EQ(image.at(21, 16)[1], 0.0f);
    EXPECT_EQ(image.at(24, 9)[3], 0.0f);
}

}  // namespace
}  // namespace umbriel
