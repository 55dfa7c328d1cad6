#include "client/trade/shadow_truth.h"

#include <cmath>
#include <numbers>

#include "client/import/procedural_mesh.h"
#include "tests/unit/session/scene_fixture.h"

namespace umbriel {
namespace {

constexpr int kSide = 64;        // pixels
constexpr double kExtent = 8.0;  // metres that they show

// A floor in y = 0 seen from straight above, things over it, one light over everything.
class Truth : public SceneFixture {
 protected:
    Truth() { floorNode = addMesh({{{-20, 0, 20}, {20, 0, 20}, {20, 0, -20}, {-20, 0, -20}}, {0, 1, 2, 0, 2, 3}}); }
    struct Shape {
        std::vector<glm::vec3> positions;
        std::vector<std::uint32_t> indices;
    };
    Ref<Node> addMesh(const Shape& shape, Ref<Container> material = {}, std::vector<glm::vec2> texCoords = {}) {
        const auto geometry = aspect.create<Geometry>();
        aspect.edit(geometry)
            .assign<&Geometry::positions>(shape.positions)
            .assign<&Geometry::indices>(shape.indices)
            .assign<&Geometry::texCoords0>(texCoords)
            .set<&Geometry::material>(material);
        return node(root, any(geometry.id));
    }
    Ref<Node> addSquare(float half, float height, Ref<Container> material = {}) {
        return addMesh({{{-half, height, half}, {half, height, half}, {half, height, -half}, {-half, height, -half}},
                        {0, 1, 2, 0, 2, 3}},
                       material, {{0, 1}, {1, 1}, {1, 0}, {0, 0}});
    }
    // The light becomes the root's parent.
    template <class Light>
    Ref<Light> addLight(const glm::dvec3& position, const glm::dvec3& travels) {
        const auto light = aspect.create<Light>("light");
        const glm::dvec3 z = -glm::normalize(travels);
        const glm::dvec3 x =
            glm::normalize(glm::cross(std::abs(z.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0), z));
        const Ref<Node> beacon =
            placed(root, position, glm::mat3(glm::vec3(x), glm::vec3(glm::cross(z, x)), glm::vec3(z)));
        aspect.edit(light).template set<&Light::beacon>(beacon);
        const Ref<Node> lit = node({}, any(light.id));
        aspect.edit(lit).append<&Node::children>(root);
        root = lit;
        return light;
    }
    std::unique_ptr<ShadowScene> build(const ShadowScene::Options& options = {}) {
        auto scene = ShadowScene::create(aspect, root, options);
        EXPECT_TRUE(scene);
        return std::move(*scene);
    }
    static double placeOf(int pixel) { return kExtent * ((pixel + 0.5) / kSide - 0.5); }
    SurfacePoints floorPoints() const {
        SurfacePoints points;
        points.width = points.height = kSide;
        points.eyeWorld = {0, 50, 0};
        points.forwardWorld = {0, -1, 0};
        points.isOrthographic = true;
        for (int y = 0; y < kSide; ++y)
            for (int x = 0; x < kSide; ++x) {
                const double worldX = placeOf(x), worldZ = placeOf(y);
                points.relative.emplace_back(worldX, -50.0, worldZ);
                points.normals.emplace_back(0, 1, 0);
                points.depths.push_back(50.0f);
                points.nodes.push_back(static_cast<std::uint32_t>(floorNode.id.value));
                points.primitives.push_back(-worldZ < worldX ? 0 : 1);
            }
        return points;
    }
    static float at(const std::vector<float>& factors, int x, int y) {
        return factors[static_cast<std::size_t>(y * kSide + x)];
    }
    Ref<Node> floorNode;
};

TEST_F(Truth, ASquareUnderASunCastsTheSquareItsGeometrySays) {
    addSquare(1.0f, 2.0f);
    addLight<DirectionalLight>({}, {1, -2, 0});  // moved by height / 2 = 1 in x
    const auto scene = build();
    const SurfacePoints points = floorPoints();
    ASSERT_EQ(scene->lights().size(), 1u);
    const auto factors = shadowTruth(*scene, points, 0);
    const auto judged = judgedPixels(*scene, points, 0, std::vector<std::uint8_t>(points.size(), 0));
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            const bool dark = std::abs(placeOf(x) - 1.0) < 1.0 && std::abs(placeOf(y)) < 1.0;
            ASSERT_EQ(at(factors, x, y), dark ? 0.0f : 1.0f) << x << ' ' << y;
            ASSERT_EQ(judged[static_cast<std::size_t>(y * kSide + x)], 1);
        }
}

TEST_F(Truth, APointLightEnlargesAndASpotEndsAtItsCone) {
    addSquare(1.0f, 2.0f);
    const auto point = addLight<PointLight>({0, 4, 0}, {0, -1, 0});  // twice as large on the floor
    const auto spot = addLight<SpotLight>({0, 4, 0}, {0, -1, 0});
    aspect.edit(spot).set<&SpotLight::outerAngle>(static_cast<float>(std::atan(3.0 / 4.0)));
    aspect.edit(point).set<&PointLight::range>(5.0f);  // 3 m from the middle on the floor, too
    const auto scene = build();
    const SurfacePoints points = floorPoints();
    ASSERT_EQ(scene->lights().size(), 2u);
    for (std::size_t light = 0; light < 2; ++light) {
        const auto factors = shadowTruth(*scene, points, light);
        const auto judged = judgedPixels(*scene, points, light, std::vector<std::uint8_t>(points.size(), 0));
        for (int y = 0; y < kSide; ++y)
            for (int x = 0; x < kSide; ++x) {
                const bool dark = std::max(std::abs(placeOf(x)), std::abs(placeOf(y))) < 2.0;
                ASSERT_EQ(at(factors, x, y), dark ? 0.0f : 1.0f) << light << ' ' << x << ' ' << y;
                const bool within = std::hypot(placeOf(x), placeOf(y)) < 3.0;
                ASSERT_EQ(judged[static_cast<std::size_t>(y * kSide + x)], within ? 1 : 0)
                    << light << ' ' << x << ' ' << y;
            }
    }
}

TEST_F(Truth, ASphereUnderAPointLightCastsADisc) {
    constexpr float kRadius = 1.0f, kCentre = 1.5f;
    constexpr double kHeight = 5.0;
    Mesh sphere;
    sphere.addSphere({0, kCentre, 0}, kRadius, 256, 128, glm::vec4(1.0f));
    addMesh({sphere.positions, sphere.indices});
    addLight<PointLight>({0, kHeight, 0}, {0, -1, 0});
    const auto scene = build();
    const SurfacePoints points = floorPoints();
    const auto factors = shadowTruth(*scene, points, 0);
    const double distance = kHeight - kCentre;
    const double radius = kHeight * kRadius / std::sqrt(distance * distance - kRadius * kRadius);
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            const double r = std::hypot(placeOf(x), placeOf(y));
            if (std::abs(r - radius) < 2e-3)
                continue;  // the sphere's facets lie 1.5e-4 inside of it, enlarged 1.5 times
            ASSERT_EQ(at(factors, x, y), r < radius ? 0.0f : 1.0f) << r;
        }
}

// A half-plane's edge above the floor: the lit part of the sun's disc is a circular segment.
TEST_F(Truth, ThePenumbraOfAnEdgeIsTheSegmentOfADisc) {
    addMesh({{{-9, 2, 9}, {0, 2, 9}, {0, 2, -9}, {-9, 2, -9}}, {0, 1, 2, 0, 2, 3}});
    addLight<DirectionalLight>({}, {0, -1, 0});
    const auto scene = build();
    scene->lights()[0].radius = std::atan(0.75);  // 1.5 m at the edge's height
    const SurfacePoints points = floorPoints();
    const auto factors = shadowTruth(*scene, points, 0);
    double worst = 0.0, sum = 0.0;
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            const double t = std::clamp(placeOf(x) / 1.5, -1.0, 1.0);
            const double expected = 0.5 + (t * std::sqrt(1.0 - t * t) + std::asin(t)) / std::numbers::pi;
            const double difference = at(factors, x, y) - expected;
            worst = std::max(worst, std::abs(difference));
            sum += difference;
        }
    EXPECT_LT(worst, 0.04);  // 16 x 16 strata: an edge crosses 16 to 23 of them, each wrong by a half at most
    EXPECT_LT(std::abs(sum) / points.size(), 1e-3);
}

// The lights' own fields: half the angle of a sun, half the width of a lamp. An edge 2 m above the floor, a sun
// straight above it, lamps 4 m above the floor: half the penumbra is 2 m tan(angle), and by similar triangles radius *
// 2 / (4 - 2).
TEST_F(Truth, PenumbraeAreAsWideAsTheLightsFieldsSay) {
    addMesh({{{-9, 2, 9}, {0, 2, 9}, {0, 2, -9}, {-9, 2, -9}}, {0, 1, 2, 0, 2, 3}});
    constexpr double kHalf = 0.8;
    const auto sun = addLight<DirectionalLight>({}, {0, -1, 0});
    aspect.edit(sun).set<&DirectionalLight::angularRadius>(static_cast<float>(std::atan(kHalf / 2.0)));
    const auto lamp = addLight<PointLight>({0, 4, 0}, {0, -1, 0});
    aspect.edit(lamp).set<&PointLight::radius>(static_cast<float>(kHalf));
    const auto spot = addLight<SpotLight>({0, 4, 0}, {0, -1, 0});
    aspect.edit(spot).set<&SpotLight::radius>(static_cast<float>(kHalf)).set<&SpotLight::outerAngle>(1.3f);
    const auto luminaire = addLight<GoniometricLight>({0, 4, 0}, {0, -1, 0});
    aspect.edit(luminaire).set<&GoniometricLight::radius>(static_cast<float>(kHalf));
    const auto scene = build();
    ASSERT_EQ(scene->lights().size(), 4u);
    const SurfacePoints points = floorPoints();
    for (std::size_t i = 0; i < 4; ++i) {
        const TruthLight& light = scene->lights()[i];
        const auto factors = shadowTruth(*scene, points, i);
        for (int x = 0; x < kSide; ++x) {
            // Where the line through the edge meets the disc, which faces the point.
            const double at = placeOf(x);
            const double onDisc =
                light.kind == LightKind::Directional ? at : 2.0 * at * std::hypot(at, 4.0) / (at * at + 8.0);
            const double t = std::clamp(onDisc / kHalf, -1.0, 1.0);
            const double expected = 0.5 + (t * std::sqrt(1.0 - t * t) + std::asin(t)) / std::numbers::pi;
            EXPECT_NEAR(Truth::at(factors, x, kSide / 2), expected, 0.05)
                << static_cast<int>(light.kind) << " at " << at;
        }
    }
}

TEST_F(Truth, ALightWithoutSizeAndAVerySmallOneAgree) {
    addSquare(1.0f, 2.0f);
    addLight<PointLight>({0.3, 4, 0.1}, {0, -1, 0});
    const auto scene = build();
    const SurfacePoints points = floorPoints();
    const auto hard = shadowTruth(*scene, points, 0);
    scene->lights()[0].radius = 1e-6;
    EXPECT_EQ(shadowTruth(*scene, points, 0), hard);
}

TEST_F(Truth, HolesOfATextureBlendedSurfacesAndExcludedNodesLetLightThrough) {
    const auto image = aspect.create<Image>();
    std::vector<std::uint8_t> texels;
    for (int row = 0; row < 2; ++row)
        for (int column = 0; column < 2; ++column)
            texels.insert(texels.end(), {255, 255, 255, static_cast<std::uint8_t>(column == 0 ? 0 : 255)});
    aspect.edit(image).set<&Image::width>(2u).set<&Image::height>(2u).assign<&Image::texels>(texels);
    const auto texture = aspect.create<Texture>();
    aspect.edit(texture)
        .set<&Texture::image>(image)
        .set<&Texture::magFilter>(FilterMode::Nearest)
        .set<&Texture::wrapS>(WrapMode::ClampToEdge);
    const auto material = aspect.create<Material>();
    aspect.edit(material).set<&Material::baseColourTexture>(texture).set<&Material::alphaMode>(AlphaMode::Mask);
    const Ref<Node> square = addSquare(2.0f, 1.0f, any(material.id));
    addLight<DirectionalLight>({}, {0, -1, 0});
    const SurfacePoints points = floorPoints();
    const auto masked = shadowTruth(*build(), points, 0);
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            const bool dark = placeOf(x) > 0.0 && placeOf(x) < 2.0 && std::abs(placeOf(y)) < 2.0;
            ASSERT_EQ(at(masked, x, y), dark ? 0.0f : 1.0f) << x << ' ' << y;
        }
    const std::vector<float> lit(points.size(), 1.0f);
    ShadowScene::Options excluded;
    excluded.excludeNodes = {square};
    EXPECT_EQ(shadowTruth(*build(excluded), points, 0), lit);
    aspect.edit(material).set<&Material::alphaMode>(AlphaMode::Blend);
    EXPECT_EQ(shadowTruth(*build(), points, 0), lit);
}

TEST_F(Truth, DoesNotDependOnThreads) {
    addSquare(1.0f, 2.0f);
    addLight<DirectionalLight>({}, {1, -2, 0.3});
    const auto scene = build();
    scene->lights()[0].radius = 0.1;
    const SurfacePoints points = floorPoints();
    EXPECT_EQ(shadowTruth(*scene, points, 0, {16, 1}), shadowTruth(*scene, points, 0, {16, 5}));
}

TEST_F(Truth, ALightReachesWhatIsBelowItsNodeOnly) {
    addLight<DirectionalLight>({}, {0, -1, 0});
    const auto scene = build();
    EXPECT_TRUE(scene->reaches(0, static_cast<std::uint32_t>(floorNode.id.value)));
    EXPECT_FALSE(scene->reaches(0, 123456));
    EXPECT_FALSE(scene->reaches(1, static_cast<std::uint32_t>(floorNode.id.value)));
    // A second floor beside the light's node.
    const Ref<Node> top = node({}, {});
    aspect.edit(top).append<&Node::children>(root);
    root = top;
    const Ref<Node> other = addMesh({{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}, {0, 1, 2}});
    const auto two = build();
    EXPECT_TRUE(two->reaches(0, static_cast<std::uint32_t>(floorNode.id.value)));
    EXPECT_FALSE(two->reaches(0, static_cast<std::uint32_t>(other.id.value)));
}

// The scene and all of its numbers moved and scaled: the same shadows.
TEST_F(Truth, HoldsAtEveryScaleAndOffset) {
    for (const double scale : {1e-3, 1.0, 1e4})
        for (const double offset : {0.0, 1e6}) {
            SCOPED_TRACE(testing::Message() << scale << " at " << offset);
            Aspect moved(types, ids);
            const auto make = [&](const Shape& shape) {
                const auto geometry = moved.create<Geometry>();
                moved.edit(geometry)
                    .assign<&Geometry::positions>(shape.positions)
                    .assign<&Geometry::indices>(shape.indices);
                const auto made = moved.create<Node>();
                moved.edit(made).set<&Node::core>(any(geometry.id));
                return made;
            };
            const auto floor = make({{{-20, 0, 20}, {20, 0, 20}, {20, 0, -20}, {-20, 0, -20}}, {0, 1, 2, 0, 2, 3}});
            const auto square = make({{{-1, 2, 1}, {1, 2, 1}, {1, 2, -1}, {-1, 2, -1}}, {0, 1, 2, 0, 2, 3}});
            const auto transform = moved.create<Transform>();
            moved.edit(transform)
                .set<&Transform::linear>(glm::mat3(static_cast<float>(scale)))
                .set<&Transform::translation>(glm::dvec3(offset));
            const auto placedNode = moved.create<Node>();
            moved.edit(placedNode)
                .set<&Node::core>(any(transform.id))
                .append<&Node::children>(floor)
                .append<&Node::children>(square);
            const auto light = moved.create<DirectionalLight>();
            const auto lit = moved.create<Node>();
            moved.edit(lit).set<&Node::core>(any(light.id)).append<&Node::children>(placedNode);
            auto scene = ShadowScene::create(moved, lit, {});
            ASSERT_TRUE(scene);
            (*scene)->lights()[0].directionWorld = glm::normalize(glm::dvec3(1, -2, 0));
            SurfacePoints points = floorPoints();
            points.eyeWorld = glm::dvec3(offset) + glm::dvec3(0, 50, 0) * scale;
            for (std::size_t i = 0; i < points.size(); ++i) {
                points.relative[i] *= static_cast<float>(scale);
                points.nodes[i] = static_cast<std::uint32_t>(floor.id.value);
            }
            const auto factors = shadowTruth(**scene, points, 0);
            for (int y = 0; y < kSide; ++y)
                for (int x = 0; x < kSide; ++x) {
                    const bool dark = std::abs(placeOf(x) - 1.0) < 1.0 && std::abs(placeOf(y)) < 1.0;
                    ASSERT_EQ(at(factors, x, y), dark ? 0.0f : 1.0f) << x << ' ' << y;
                }
        }
}

TEST_F(Truth, ABoxOnAPlaneHasASilhouetteButItsFootHasNone) {
    // Seen along -z: a wall from z = 0 (left half) and one 3 m behind it (right half), a floor in front.
    SurfacePoints points;
    points.width = points.height = 16;
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) {
            const double u = (x + 0.5) / 8.0 - 1.0, v = 1.0 - (y + 0.5) / 8.0;  // direction (u, v, -1)
            // A crease: the floor in y = -1 meets the wall in z = -4 (left) where v = -1/4; the right wall is at -7.
            const double wall = x < 8 ? 4.0 : 7.0;
            const bool onFloor = v < 0.0 && -1.0 / v < wall;
            const double depth = onFloor ? -1.0 / v : wall;
            points.relative.emplace_back(u * depth, v * depth, -depth);
            points.normals.emplace_back(onFloor ? glm::vec3(0, 1, 0) : glm::vec3(0, 0, 1));
            points.depths.push_back(static_cast<float>(depth));
            points.nodes.push_back(onFloor ? 1 : x < 8 ? 2 : 3);
            points.primitives.push_back(0);
        }
    const auto marked = silhouettes(points);
    const auto is = [&](int x, int y) { return marked[static_cast<std::size_t>(y * 16 + x)] != 0; };
    for (int y = 1; y < 8; ++y) {
        EXPECT_TRUE(is(7, y)) << y;
        EXPECT_TRUE(is(8, y)) << y;
        EXPECT_FALSE(is(5, y)) << y;
        EXPECT_FALSE(is(10, y)) << y;
    }
    for (int x = 1; x < 7; ++x)
        for (int y = 8; y < 15; ++y)
            EXPECT_FALSE(is(x, y)) << x << ' ' << y;  // the foot of the left wall, and the floor
    EXPECT_TRUE(is(0, 5));                            // the picture's border
}

TEST_F(Truth, ASquareMovedByLessThanATexelIsAnEdgeAndByMoreIsALeak) {
    addSquare(1.0f, 2.0f);
    addLight<DirectionalLight>({}, {0, -1, 0});
    const auto scene = build();
    const SurfacePoints points = floorPoints();
    const auto truth = shadowTruth(*scene, points, 0);
    const auto judged = judgedPixels(*scene, points, 0, std::vector<std::uint8_t>(points.size(), 0));
    ShadowFit fit;
    fit.mapSize = 32;  // texels of half a metre over 16 m
    fit.clipFromWorld = glm::dmat4(glm::dvec4(1.0 / 8, 0, 0, 0), glm::dvec4(0, 0, 0.01, 0),
                                   glm::dvec4(0, -1.0 / 8, 0, 0), glm::dvec4(0, 0, 0.5, 1));
    for (const int pixels : {3, 6}) {  // 0.375 and 0.75 m
        std::vector<float> result(points.size(), 1.0f);
        for (int y = 0; y < kSide; ++y)
            for (int x = 0; x + pixels < kSide; ++x)
                result[static_cast<std::size_t>(y * kSide + x + pixels)] = at(truth, x, y);
        const BeyondTexel beyond = beyondTexel(*scene, points, 0, {&fit, 1}, truth, result, judged);
        // Each side: the pixels from 0.5 to 0.75 m away, 2 columns of 16 rows.
        EXPECT_EQ(beyond.leaks > 0, pixels == 6);
        EXPECT_EQ(beyond.acne > 0, pixels == 6);
        if (pixels == 6) {
            EXPECT_EQ(beyond.acne, 2u * 16u);
        }
    }
}

TEST_F(Truth, TheOtherEyeSeesTheSamePoints) {
    const SurfacePoints left = floorPoints();
    SurfacePoints right = floorPoints();
    // An orthographic view straight down, moved by exactly three pixels.
    const double moved = 3.0 * kExtent / kSide;
    right.eyeWorld.x += moved;
    for (std::size_t i = 0; i < right.size(); ++i) right.primitives[i] = 0;
    View view;
    view.eyeWorld = right.eyeWorld;
    view.viewFromWorld = glm::transpose(glm::dmat3(glm::dvec3(1, 0, 0), glm::dvec3(0, 0, -1), glm::dvec3(0, 1, 0)));
    view.clipFromView = glm::dmat4(glm::dvec4(2.0 / kExtent, 0, 0, 0), glm::dvec4(0, 2.0 / kExtent, 0, 0),
                                   glm::dvec4(0, 0, 0.01, 0), glm::dvec4(0, 0, 0, 1));
    const auto matches = matchSurfaces(left, right, view);
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            const std::uint32_t match = matches[static_cast<std::size_t>(y * kSide + x)];
            if (x < 3)
                EXPECT_EQ(match, kNoMatch);
            else
                EXPECT_EQ(match, static_cast<std::uint32_t>(y * kSide + x - 3));
        }
    // Another third of a pixel on: the pixel's neighbours to the left surround the place.
    view.eyeWorld.x = right.eyeWorld.x = moved + 0.3 * kExtent / kSide;
    const auto around = surfacesAround(left, right, view);
    for (int y = 1; y + 1 < kSide; ++y)
        for (int x = 5; x + 1 < kSide; ++x) {
            const auto& four = around[static_cast<std::size_t>(y * kSide + x)];
            const auto hit = static_cast<std::uint32_t>(y * kSide + x - 3);
            EXPECT_EQ(four[0], hit);
            EXPECT_EQ(four[1], hit - 1);
            EXPECT_TRUE(four[2] == hit - kSide || four[2] == hit + kSide);
            EXPECT_EQ(four[3], four[2] - 1);
        }
    EXPECT_EQ(around[static_cast<std::size_t>(kSide)][0], kNoMatch);
}

}  // namespace
}  // namespace umbriel
