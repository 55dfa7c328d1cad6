// Light maps baked from shadow modules: drawn in texture space, against those that rays make.

#include "client/app/light_map_drawing.h"

#include "client/app/light_map_scene.h"
#include "tests/shadows/shadow_fixture.h"

namespace umbriel {
namespace {

class DrawnLightMaps : public ModuleTest {
 protected:
    // By rays; the scene stays as it is.
    LightMapFile traced(const LightMapOptions& options, const std::vector<std::string>& moving = {}) {
        auto file = bakeLightMapOf(*scene, root, options, moving);
        EXPECT_TRUE(file) << (file ? "" : file.error().message);
        return file ? std::move(*file) : LightMapFile();
    }
    // The scene is unwrapped afterwards.
    LightMapFile drawn(ShadowMode mode, std::uint32_t mapSize, const LightMapOptions& options, int columns = 1,
                       int rows = 1, const std::vector<std::string>& moving = {}) {
        scene->edit(viewport)
            .set<&Viewport::shadowMode>(mode)
            .set<&Viewport::mapSize>(mapSize)
            .set<&Viewport::reuseMaps>(true)
            .set<&Viewport::camera>(Ref<Container>());
        look({0, 12, 28}, {0, 1, 0});
        LightMapDrawing drawing(*scene, window, viewport, [&](Aspect& of, const WallViews& views) {
            return drawnTiles(of, views, columns, rows);
        });
        auto file = bakeLightMapOf(*scene, root, options, moving, &drawing);
        EXPECT_TRUE(file) << (file ? "" : file.error().message);
        return file ? std::move(*file) : LightMapFile();
    }
    Result<std::vector<TilePixels>> drawnTiles(Aspect& of, const WallViews& views, int columns, int rows) {
        renderer->sceneChanged(of.commit(), of);
        std::vector<TilePixels> all;
        for (const TileAssignment& tile : grid(views.wall, columns, rows)) {
            const auto done = renderer->draw(of, views, {&tile, 1}, 0.0);
            if (!done) return done.error();
            auto read = renderer->readTiles();
            if (!read) return read.error();
            for (TilePixels& pixels : *read) all.push_back(std::move(pixels));
            plan = renderer->explain();
            ++frames;
        }
        return all;
    }
    // Shares of the texels that hold something: wrong by more than half, and the root of the mean square.
    struct Difference {
        double wrong = 0.0, rmse = 0.0;
    };
    static Difference differenceOf(const LightMapFile& file, const LightMapFile& truth) {
        Difference difference;
        EXPECT_EQ(file.baked.texels.size(), truth.baked.texels.size());
        EXPECT_EQ(file.baked.charts, truth.baked.charts);
        EXPECT_EQ(file.baked.places, truth.baked.places);
        EXPECT_EQ(file.states, truth.states);
        EXPECT_EQ(file.lightStates, truth.lightStates);
        if (file.baked.texels.size() != truth.baked.texels.size() || truth.baked.covered == 0) return difference;
        for (std::size_t i = 0; i < file.baked.texels.size(); ++i) {
            const double error = (file.baked.texels[i] - truth.baked.texels[i]) / 255.0;
            difference.wrong += std::abs(error) > 0.5;
            difference.rmse += error * error;
        }
        const auto covered = static_cast<double>(truth.baked.covered);
        return {difference.wrong / covered, std::sqrt(difference.rmse / covered)};
    }
    static LightMapOptions optionsOf(std::uint32_t size, int samples = 2) {
        LightMapOptions options;
        options.size = size;
        options.samples = samples;
        options.threads = 2;
        return options;
    }
    // The factor at a point of a surface's triangle, in its object space, of the texel that it lies in.
    static int at(const LightMapFile& file, std::size_t triangle, const glm::vec3& object, std::size_t light = 0) {
        const BakedLightMap& map = file.baked;
        const std::size_t chart = 3 * std::size_t{map.places[triangle]};
        const glm::vec4 place(object, 1.0f), range = map.charts[chart + 2];
        const auto u = static_cast<std::size_t>(std::clamp(glm::dot(map.charts[chart], place), range.x, range.z));
        const auto v = static_cast<std::size_t>(std::clamp(glm::dot(map.charts[chart + 1], place), range.y, range.w));
        return map.texels[(light * map.size + v) * map.size + u];
    }
    // A square in the plane y = const, wound as if seen from above; its first triangle's number is known to the test.
    Ref<Node> square(Ref<Node> parent, float half, double y, Ref<Material> of,
                     const std::vector<glm::vec2>& set1 = {}) {
        const Ref<Geometry> made = scene->create<Geometry>();
        scene->edit(made)
            .assign<&Geometry::positions>(
                std::vector<glm::vec3>{{-half, 0, half}, {half, 0, half}, {half, 0, -half}, {-half, 0, -half}})
            .assign<&Geometry::indices>(std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3})
            .assign<&Geometry::texCoords1>(set1)
            .set<&Geometry::material>(Ref<Container>(of.id));
        return node(placed(parent, {0, y, 0}), made);
    }

    std::string plan;
    int frames = 0;
};

class ModesOfLights : public DrawnLightMaps, public ::testing::WithParamInterface<std::pair<ShadowMode, int>> {};

TEST_P(ModesOfLights, ComeNearToRaysAsTheShadowMapsGrow) {
    const ShadowMode mode = GetParam().first;
    const auto place = static_cast<LightPlace>(GetParam().second);
    const auto build = [&] {
        SetUp();
        buildTown(15.0, 40);
        finishScene(place, {2, 16, 3},
                    place == LightPlace::Directional ? glm::dvec3(0.5, -0.7, -0.3) : glm::dvec3(0, -1, 0),
                    1.35f);  // beyond the cone, where no light is, rays and maps need not agree
    };
    build();
    const LightMapFile truth = traced(optionsOf(384));
    double last = 1.0, before = 1.0;
    for (const std::uint32_t size : {512u, 1024u, 2048u, 4096u}) {
        build();
        const Difference difference = differenceOf(drawn(mode, size, optionsOf(384)), truth);
        std::printf("mode %u, light %d, %u texels: wrong %.3f %%, rmse %.4f\n", static_cast<unsigned>(mode),
                    static_cast<int>(place), size, 100 * difference.wrong, difference.rmse);
        // Where a wall stands less than a map's offset before another, it is lost all at once: from one size to the
        // next the error may stay, over two it does not.
        EXPECT_LT(difference.wrong, 0.5 * before);
        EXPECT_LT(difference.wrong, last);
        before = last;
        last = difference.wrong;
    }
    EXPECT_LT(last, 0.001);
    EXPECT_NE(plan.find("shadow-map"), std::string::npos) << plan;
    EXPECT_EQ(plan.find("surfaces"), std::string::npos) << plan;
}

INSTANTIATE_TEST_SUITE_P(DrawnLightMaps, ModesOfLights,
                         ::testing::Values(std::pair(ShadowMode::Standard, 0), std::pair(ShadowMode::Standard, 1),
                                           std::pair(ShadowMode::Cube, 2), std::pair(ShadowMode::DualParaboloid, 2)));

// The town of LightMaps.ErrorFallsWithTheAtlas..., drawn with light maps of each origin.
class SizesOfDrawnLightMaps : public DrawnLightMaps, public ::testing::WithParamInterface<std::uint32_t> {};

TEST_P(SizesOfDrawnLightMaps, GivePicturesNearlyAsTrueAsRays) {
    const std::uint32_t size = GetParam();
    const auto build = [&] {
        SetUp();
        buildTown(30.0, 60);
        finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    };
    double ofRays = 0.0;
    for (const ShadowMode mode : {ShadowMode::None, ShadowMode::Standard, ShadowMode::PercentageCloser}) {
        build();
        const LightMapFile file =
            mode == ShadowMode::None ? traced(optionsOf(size, 4)) : drawn(mode, 2048, optionsOf(size, 4));
        build();
        look({0, 12, 28}, {0, 1, 0});
        scene->edit(viewport).set<&Viewport::shadowMode>(ShadowMode::LightMap);
        const auto attached = attachLightMap(*scene, window, file);
        ASSERT_TRUE(attached) << attached.error().message;
        const Errors errors = measure();
        ASSERT_TRUE(warnings.empty()) << warnings.front();
        std::printf("light map %u of mode %u: error %.3f %%, rmse %.4f\n", size, static_cast<unsigned>(mode),
                    100 * errors.error, errors.rmse);
        if (mode == ShadowMode::None) ofRays = errors.error;
        EXPECT_LT(errors.error, ofRays + 0.001);
    }
}

INSTANTIATE_TEST_SUITE_P(DrawnLightMaps, SizesOfDrawnLightMaps, ::testing::Values(256u, 512u, 1024u));

// A plate over a floor: its shadow is itself, moved along the light.
TEST_F(DrawnLightMaps, ThePlatesShadowLiesWhereItMust) {
    const glm::dvec3 travel(0.4, -1.0, -0.25);
    const double height = 2.0, half = 1.5, floorHalf = 6.0;
    finishScene(LightPlace::Directional, {0, 0, 0}, travel * worldFromLocal);
    const auto white = material({1, 1, 1, 1});
    square(lightNode, static_cast<float>(floorHalf), 0.0, white);
    square(lightNode, static_cast<float>(half), height, white);
    const LightMapFile file = drawn(ShadowMode::Standard, 2048, optionsOf(256, 4));
    ASSERT_EQ(file.baked.places.size(), 4u);
    const double border = 0.05 + file.baked.texelMetres;  // of a texel of each map
    std::size_t dark = 0, lit = 0;
    for (int z = 0; z < 300; ++z)
        for (int x = 0; x < 300; ++x) {
            const glm::dvec3 point(-floorHalf + (x + 0.5) * floorHalf / 150, 0,
                                   -floorHalf + (z + 0.5) * floorHalf / 150);
            const glm::dvec3 from = point - travel * height;
            const double inside = half - std::max(std::abs(from.x), std::abs(from.z));
            if (std::abs(inside) < border) continue;
            ASSERT_EQ(at(file, 0, glm::vec3(point)), inside > 0 ? 0 : 255) << point.x << ", " << point.z;
            ++(inside > 0 ? dark : lit);
        }
    EXPECT_GT(dark, 4000u);
    EXPECT_GT(lit, 60000u);
    // From the plate's lower side, too, nothing keeps the light away: it arrives on the other side.
    EXPECT_EQ(at(file, 2, glm::vec3(0.0f)), 255);
}

TEST_F(DrawnLightMaps, AreTheSameBytesOnAnyTiles) {
    std::vector<std::uint8_t> first;
    for (const auto& [columns, rows] : {std::pair(1, 1), std::pair(3, 2)}) {
        SetUp();
        buildTown(20.0, 40);
        finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
        // More than one look-up: 600 texels of 4 x 4 points.
        const LightMapFile file = drawn(ShadowMode::PercentageCloser, 512, optionsOf(600, 4), columns, rows);
        EXPECT_GT(frames, columns * rows);
        frames = 0;
        if (first.empty()) first = file.baked.texels;
        EXPECT_EQ(file.baked.texels, first) << columns << "x" << rows;
    }
    EXPECT_GT(std::count(first.begin(), first.end(), 0), 10000);
    EXPECT_GT(std::count_if(first.begin(), first.end(), [](int v) { return v > 20 && v < 235; }), 1000);
}

// Soft shadows of a lamp with a size: the module that knows it is nearer to the truth than the one that does not.
TEST_F(DrawnLightMaps, PenumbraeOfALargeSunAreThoseOfContactHardening) {
    const auto build = [&] {
        SetUp();
        block({-8, -1, -8}, {8, 0, 8});
        block({-2, 0, -1}, {2, 4, 1});
        block({3, 2, -3}, {5, 2.5, 3});
        finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.9, -0.2}, 0.7f, 0.06f);
    };
    build();
    LightMapOptions options = optionsOf(256, 2);
    options.lightSamples = 6;
    const LightMapFile truth = traced(options);
    build();
    const Difference hard = differenceOf(drawn(ShadowMode::Standard, 1024, options), truth);
    build();
    const Difference soft = differenceOf(drawn(ShadowMode::PercentageCloserSoft, 1024, options), truth);
    std::printf("hard rmse %.4f, soft rmse %.4f\n", hard.rmse, soft.rmse);
    EXPECT_LT(soft.rmse, 0.75 * hard.rmse);  // measured: 0.60
}

// What is blended is darkened and casts nothing, what is cut out casts its holes, also those of set 1; what moves is
// not there; a light that does not reach a surface is not kept from it.
TEST_F(DrawnLightMaps, KnowWhatRaysKnowOfSurfaces) {
    const auto build = [&] {
        SetUp();
        finishScene(LightPlace::Directional, {0, 0, 0}, {0.2, -1.0, 0.1});
        const auto white = material({1, 1, 1, 1});
        square(lightNode, 6.0f, 0.0, white);  // triangles 0, 1
        const auto glass = material({1, 1, 1, 0.5});
        scene->edit(glass).set<&Material::alphaMode>(AlphaMode::Blend);
        square(lightNode, 2.0f, 1.0, glass);  // 2, 3
        // Left half solid, right half not; by coordinates that are not where it lies in the atlas.
        const auto cut = material({1, 1, 1, 1});
        std::vector<std::uint8_t> texels;
        for (int i = 0; i < 16; ++i) texels.insert(texels.end(), {255, 255, 255, std::uint8_t(i % 4 < 2 ? 255 : 0)});
        const Ref<Texture> holes = checkerTexture(4, texels);
        scene->edit(holes)
            .set<&Texture::texCoordSet>(1u)
            .set<&Texture::wrapS>(WrapMode::ClampToEdge)
            .set<&Texture::magFilter>(FilterMode::Nearest)
            .set<&Texture::minFilter>(FilterMode::Nearest)
            .set<&Texture::mipMode>(MipMode::None);
        scene->edit(cut).set<&Material::alphaMode>(AlphaMode::Mask).set<&Material::baseColourTexture>(holes);
        square(lightNode, 1.0f, 2.0, cut, {{0, 0}, {1, 0}, {1, 1}, {0, 1}});  // 4, 5
        const Ref<Node> crane = square(lightNode, 3.0f, 3.0, white);
        scene->edit(crane).set<&Node::name>("crane");
        square(root, 6.0f, -1.0, white);  // 6, 7: below the other, and out of the light's reach
    };
    build();
    const LightMapFile truth = traced(optionsOf(256, 4), {"crane"});
    build();
    const LightMapFile file = drawn(ShadowMode::Standard, 2048, optionsOf(256, 4), 1, 1, {"crane"});
    ASSERT_EQ(file.baked.places.size(), 8u);
    const glm::dvec3 travel = lightDirection / -lightDirection.y;
    for (const LightMapFile* map : {&truth, &file}) {
        const auto floor = [&](double x, double z, double above) {
            return at(*map, 0, glm::vec3(glm::dvec3(x, 0, z) + glm::dvec3(travel.x, 0, travel.z) * above));
        };
        EXPECT_EQ(floor(-0.5, 0.0, 2.0), 0) << "below the solid half";
        EXPECT_EQ(floor(0.5, 0.0, 2.0), 255) << "below the hole";
        EXPECT_EQ(floor(1.6, 1.6, 1.0), 255) << "below the glass, and where the crane's shadow would be";
        EXPECT_EQ(at(*map, 2, glm::vec3(glm::dvec3(-0.5, 0, 0) + glm::dvec3(travel.x, 0, travel.z))), 0)
            << "on the glass";
        EXPECT_EQ(at(*map, 2, glm::vec3(1.7f, 0, 1.7f)), 255) << "on the glass";
        EXPECT_EQ(at(*map, 6, glm::vec3(0.0f)), 255) << "out of reach";
    }
    EXPECT_LT(differenceOf(file, truth).wrong, 0.004);
}

// Up to the edges, where bilinear look-ups mix them with nothing else.
TEST_F(DrawnLightMaps, TheFacesOfACubeAreDarkOrLit) {
    block({-1, -1, -1}, {1, 1, 1});
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.3, -1.0, -0.4});
    const LightMapFile file = drawn(ShadowMode::Standard, 512, optionsOf(64, 4));
    ASSERT_EQ(file.baked.places.size(), 12u);
    const Mesh mesh = boxMesh(glm::vec3(1.0f));
    std::size_t lit = 0, dark = 0;
    for (std::size_t triangle = 0; triangle < 12; ++triangle) {
        const glm::vec3 normal = glm::mat3(worldFromLocal) * mesh.normals[mesh.indices[3 * triangle]];
        const bool faces = glm::dot(glm::dvec3(normal), lightDirection) < 0.0;
        const std::size_t chart = 3 * std::size_t{file.baked.places[triangle]};
        const glm::vec4 range = file.baked.charts[chart + 2];
        for (auto v = static_cast<std::size_t>(range.y); v <= static_cast<std::size_t>(range.w); ++v)
            for (auto u = static_cast<std::size_t>(range.x); u <= static_cast<std::size_t>(range.z); ++u) {
                const int texel = file.baked.texels[v * 64 + u];
                ASSERT_EQ(texel, faces ? 255 : 0) << triangle << ": " << u << ", " << v;
                ++(faces ? lit : dark);
            }
    }
    EXPECT_GT(lit, 1000u);
    EXPECT_GT(dark, 1000u);
}

TEST_F(DrawnLightMaps, FailWithTheDrawersReason) {
    buildTown(10.0, 4);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    look({0, 6, 12}, {0, 1, 0});
    LightMapDrawing nothing(*scene, window, viewport, [](Aspect&, const WallViews&) -> Result<std::vector<TilePixels>> {
        return failure("server left is gone");
    });
    const auto gone = bakeLightMapOf(*scene, root, optionsOf(64), {}, &nothing);
    ASSERT_FALSE(gone);
    EXPECT_EQ(gone.error().message, "server left is gone");
    EXPECT_EQ(gone.error().kind, Error::Kind::Failure);
    SetUp();
    buildTown(10.0, 4);
    finishScene(LightPlace::Directional, {0, 0, 0}, {0.5, -0.7, -0.3});
    look({0, 6, 12}, {0, 1, 0});
    LightMapDrawing empty(*scene, window, viewport, [](Aspect&, const WallViews&) {
        return Result<std::vector<TilePixels>>(std::vector<TilePixels>(1));
    });
    const auto bare = bakeLightMapOf(*scene, root, optionsOf(64), {}, &empty);
    ASSERT_FALSE(bare);
    EXPECT_NE(bare.error().message.find("no factors of light 0"), std::string::npos);
}

}  // namespace
}  // namespace umbriel
