#include <functional>

#include "tests/golden/illumination_fixture.h"

namespace umbriel {
namespace {

class FrequencyTest : public IlluminationTest {
 protected:
    // A quad whose normals lean outwards by an angle at its four corners.
    Mesh domed(float lean) {
        Mesh mesh = gridMesh(1.0f);
        for (std::size_t i = 0; i < mesh.positions.size(); ++i)
            mesh.normals[i] = glm::normalize(
                glm::vec3(glm::sign(mesh.positions[i].x) * lean, glm::sign(mesh.positions[i].y) * lean, 1));
        return mesh;
    }
    Ref<Geometry> shaded(Ref<Node> parent, const Mesh& mesh, Ref<Material> of, ShadingFrequency shading) {
        const Ref<Geometry> made = geometry(mesh, of);
        scene->edit(made).set<&Geometry::shading>(shading);
        node(parent, made);
        return made;
    }
    // The truth at a vertex of the quad, seen straight on from far away.
    glm::dvec3 atVertex(const Material& of, const Mesh& mesh, std::size_t vertex) const {
        ShadedPoint point;
        point.positionWorld = glm::dvec3(mesh.positions[vertex]);
        point.normalWorld = glm::normalize(glm::dvec3(mesh.normals[vertex]));
        point.baseColour = glm::dvec3(glm::vec3(of.baseColour.get()));
        return radianceTruth(*scene, of, point, lights());
    }
};

TEST_F(FrequencyTest, GouraudInterpolatesTheRadianceOfTheVertices) {
    const auto lamp = scene->create<PointLight>();
    scene->edit(lamp).set<&PointLight::intensity>(glm::vec3(6.0f));
    const Ref<Node> below = standing(root, lamp, {-0.6, 0.9, 1.0});
    const Ref<Material> of = glossy(ReflectionModel::BlinnPhong);
    const Mesh mesh = domed(0.6f);
    shaded(below, mesh, of, ShadingFrequency::Gouraud);
    const WallImage image = drawColour(wallViews(flatView(2.0, {40, 40})));
    ASSERT_FALSE(image.values.empty());
    glm::dvec3 corners[4];
    for (std::size_t i = 0; i < 4; ++i) corners[i] = atVertex(scene->get(of), mesh, i);
    for (const glm::ivec2 pixel : {glm::ivec2(30, 5), glm::ivec2(38, 20), glm::ivec2(20, 3)}) {
        // In the triangle 0, 1, 3 (below the diagonal): x and y are its coordinates.
        const double x = (pixel.x + 0.5) / 40;
        const double y = (pixel.y + 0.5) / 40;
        ASSERT_GT(x, y);
        const glm::dvec3 expected = corners[0] * (1 - x) + corners[1] * (x - y) + corners[3] * y;
        for (int channel = 0; channel < 3; ++channel)
            EXPECT_NEAR(image.at(pixel.x, pixel.y)[channel], expected[channel], 3e-6 + 2e-5 * expected[channel]);
    }
    EXPECT_NE(renderer->explain().find("vertex-shading"), std::string::npos);
}

// The failure that the textbook shows: a highlight in the middle of a face, far from its vertices.
TEST_F(FrequencyTest, GouraudMissesAHighlightInsideAFaceAndPhongDoesNot) {
    float middle[2];
    for (const ShadingFrequency shading : {ShadingFrequency::Gouraud, ShadingFrequency::Phong}) {
        SetUp();
        const auto sun = scene->create<DirectionalLight>();
        const Ref<Material> of = glossy(ReflectionModel::BlinnPhong);
        scene->edit(of).set<&Material::shininess>(200.0f).set<&Material::specular>(glm::vec3(1.0f));
        shaded(lit(root, sun, {0, 0, -1}, glm::vec3(3.14159265f)), domed(0.6f), of, shading);
        const WallImage image = drawColour(wallViews(flatView(2.0, {41, 41})));
        ASSERT_FALSE(image.values.empty());
        middle[shading == ShadingFrequency::Phong] = image.at(20, 20)[0];
    }
    EXPECT_GT(middle[1], 1.4f);  // 0.5 diffuse and the highlight
    EXPECT_LT(middle[0], 0.5f);
}

TEST_F(FrequencyTest, FlatIsTheRadianceOfTheFirstVertexAllOverATriangle) {
    const auto lamp = scene->create<PointLight>();
    scene->edit(lamp).set<&PointLight::intensity>(glm::vec3(6.0f));
    const Ref<Material> of = glossy(ReflectionModel::PhongGated);
    const Mesh mesh = domed(0.6f);
    const Ref<Node> below = standing(root, lamp, {0.6, 0.5, 1.0});
    shaded(below, mesh, of, ShadingFrequency::Flat);
    const WallImage image = drawColour(wallViews(flatView(2.0, {40, 40})));
    ASSERT_FALSE(image.values.empty());
    const glm::dvec3 expected = atVertex(scene->get(of), mesh, 0);  // both triangles begin with it
    for (const glm::ivec2 pixel : {glm::ivec2(30, 5), glm::ivec2(5, 30), glm::ivec2(39, 38)})
        EXPECT_NEAR(image.at(pixel.x, pixel.y)[0], expected.x, 2e-5 * expected.x);
    EXPECT_EQ(image.at(30, 5)[1], image.at(38, 20)[1]);
}

TEST_F(FrequencyTest, FlatMeanShadesATrianglesCentreWithItsMeanNormal) {
    const auto lamp = scene->create<PointLight>();
    scene->edit(lamp).set<&PointLight::intensity>(glm::vec3(6.0f));
    const Ref<Material> of = glossy(ReflectionModel::Phong);
    const Mesh mesh = domed(0.6f);
    const Ref<Node> below = standing(root, lamp, {0.6, 0.5, 1.0});
    const Ref<Geometry> quad = shaded(below, mesh, of, ShadingFrequency::FlatMean);
    const auto expectCentres = [&](const Mesh& now) {
        const WallImage image = drawColour(wallViews(flatView(2.0, {40, 40})));
        ASSERT_FALSE(image.values.empty());
        const glm::ivec2 inside[2] = {{30, 10}, {10, 30}};
        for (std::size_t triangle = 0; triangle < 2; ++triangle) {
            ShadedPoint point;
            point.normalWorld = glm::dvec3(0.0);
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t vertex = now.indices[triangle * 3 + k];
                point.positionWorld += glm::dvec3(now.positions[vertex]) / 3.0;
                point.normalWorld += glm::dvec3(now.normals[vertex]);
            }
            point.normalWorld = glm::normalize(point.normalWorld);
            point.baseColour = glm::dvec3(glm::vec3(scene->get(of).baseColour.get()));
            const glm::dvec3 expected = radianceTruth(*scene, scene->get(of), point, lights());
            const float* pixel = image.at(inside[triangle].x, inside[triangle].y);
            EXPECT_NEAR(pixel[0], expected.x, 2e-5 * expected.x) << triangle;
        }
        EXPECT_EQ(image.at(30, 10)[0], image.at(38, 2)[0]);
    };
    expectCentres(mesh);
    Mesh moved = mesh;
    moved.normals[1] = glm::normalize(glm::vec3(-0.5f, 0.2f, 1.0f));
    scene->edit(quad).write<&Geometry::normals>(1, std::vector<glm::vec3>{moved.normals[1]});
    expectCentres(moved);
}

TEST_F(FrequencyTest, ASurfaceWithoutNormalsIsFlatAtEveryFrequency) {
    std::vector<WallImage> images;
    for (const ShadingFrequency shading :
         {ShadingFrequency::Phong, ShadingFrequency::Gouraud, ShadingFrequency::Flat, ShadingFrequency::FlatMean}) {
        SetUp();
        const auto sun = scene->create<DirectionalLight>();
        Mesh mesh = boxMesh(glm::vec3(0.7f));
        mesh.normals.clear();
        shaded(lit(root, sun, {0.3f, -0.5f, -1}), mesh, glossy(ReflectionModel::TorranceSparrow), shading);
        images.push_back(drawColour(wallViews(slanted())));
        ASSERT_FALSE(images.back().values.empty());
        EXPECT_EQ(differingPixels(images.front(), images.back()), 0u);
        EXPECT_EQ(renderer->explain().find("vertex-shading"), std::string::npos);
    }
}

// Two-sided lighting: the back is lit as a front that faces the other way.
TEST_F(FrequencyTest, BothSidesAreLitAtEveryFrequency) {
    for (const ShadingFrequency shading :
         {ShadingFrequency::Phong, ShadingFrequency::Gouraud, ShadingFrequency::Flat, ShadingFrequency::FlatMean}) {
        WallImage sides[2];
        for (const bool turned : {false, true}) {
            SetUp();
            const auto sun = scene->create<DirectionalLight>();
            const Ref<Material> of = glossy(ReflectionModel::PhongGated);
            scene->edit(of).set<&Material::doubleSided>(true);
            Mesh mesh = gridMesh(1.0f);
            if (turned) {
                for (glm::vec3& normal : mesh.normals) normal = -normal;
                for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
                    std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
            }
            shaded(lit(root, sun, {0.2f, 0.1f, -1}), mesh, of, shading);
            sides[turned] = drawColour(wallViews(flatView(1.5, {16, 16})));
            ASSERT_FALSE(sides[turned].values.empty());
        }
        EXPECT_GT(sides[0].at(8, 8)[0], 0.05f);
        for (int channel = 0; channel < 3; ++channel)
            EXPECT_NEAR(sides[0].at(8, 8)[channel], sides[1].at(8, 8)[channel], 1e-6f)
                << static_cast<unsigned>(shading);
    }
}

// As OpenGL modulates: the texel of the pixel multiplies what the vertices found for white.
TEST_F(FrequencyTest, TheBaseTextureMultipliesInThePixel) {
    const auto sun = scene->create<DirectionalLight>();
    const Ref<Material> of = glossy(ReflectionModel::BlinnPhong);
    scene->edit(of).set<&Material::emission>(glm::vec3(0.0f));
    shaded(lit(root, sun, {0.3f, 0, -1}), gridMesh(1.0f), of, ShadingFrequency::Gouraud);
    const View view = flatView(1.5, {16, 16});
    const WallImage plain = drawColour(wallViews(view));
    ASSERT_FALSE(plain.values.empty());
    EXPECT_EQ(renderer->explain().find("uv0"), std::string::npos) << renderer->explain();
    const Ref<Texture> magenta = checkerTexture(1, {255, 0, 255, 255});  // 0 and 1 in any encoding
    scene->edit(of).set<&Material::baseColourTexture>(magenta);
    const WallImage textured = drawColour(wallViews(view));
    ASSERT_FALSE(textured.values.empty());
    EXPECT_NE(renderer->explain().find("uv0 base-colour-map"), std::string::npos) << renderer->explain();
    for (int channel = 0; channel < 3; ++channel)
        EXPECT_NEAR(textured.at(8, 8)[channel], channel == 1 ? 0.0f : plain.at(8, 8)[channel], 1e-6f);
}

// A map of one texel is a factor, wherever it is looked up.
TEST_F(FrequencyTest, MapsAtVerticesWeighAsFactorsDo) {
    struct Case {
        ReflectionModel model;
        std::function<void(Ref<Material>, bool asMap)> give;
    };
    const Case cases[] = {
        {ReflectionModel::BlinnPhong,
         [this](Ref<Material> of, bool asMap) {
             const glm::vec3 share(0.0f, 1.0f, 0.0f);  // what no driver rounds when it decodes sRGB
             const glm::vec3 colour(0.8f, 0.7f, 0.6f);
             scene->edit(of).set<&Material::specular>(asMap ? colour : colour * share);
             if (asMap) scene->edit(of).set<&Material::specularTexture>(checkerTexture(1, {0, 255, 0, 255}));
         }},
        {ReflectionModel::MetallicRoughness,
         [this](Ref<Material> of, bool asMap) {
             scene->edit(of)
                 .set<&Material::roughness>(asMap ? 1.0f : 0.4f)
                 .set<&Material::metallic>(asMap ? 1.0f : 0.2f);
             if (asMap) scene->edit(of).set<&Material::metallicRoughnessTexture>(checkerTexture(1, {0, 102, 51, 255}));
         }},
        {ReflectionModel::GeneralSum,
         [this](Ref<Material> of, bool asMap) {
             const glm::vec3 ambient(0.9f, 0.6f, 0.3f);
             scene->edit(of).set<&Material::ambient>(asMap ? ambient : ambient * 0.4f);
             if (asMap) scene->edit(of).set<&Material::occlusionTexture>(checkerTexture(1, {102, 0, 0, 255}));
         }},
    };
    for (const Case& one : cases)
        for (const ShadingFrequency shading : {ShadingFrequency::Gouraud, ShadingFrequency::Flat}) {
            WallImage images[2];
            for (const bool asMap : {false, true}) {
                SetUp();
                const auto sun = scene->create<DirectionalLight>();
                const auto sky = scene->create<AmbientLight>();
                scene->edit(sky).set<&AmbientLight::radiance>(glm::vec3(0.5f));
                const Ref<Material> of = glossy(one.model);
                one.give(of, asMap);
                shaded(lit(node(root, sky), sun, {0.3f, 0, -1}), domed(0.3f), of, shading);
                images[asMap] = drawColour(wallViews(flatView(1.5, {16, 16})));
                ASSERT_FALSE(images[asMap].values.empty());
            }
            EXPECT_NE(renderer->explain().find("vertex-shading"), std::string::npos);
            for (std::size_t i = 0; i < images[0].values.size(); ++i)
                ASSERT_NEAR(images[0].values[i], images[1].values[i], 1e-6f + 1e-5f * images[0].values[i])
                    << static_cast<unsigned>(one.model) << " " << static_cast<unsigned>(shading);
        }
}

// Four texels, each of which one corner sees: the normals they hold, given to the corners, make the same picture, on
// both sides.
TEST_F(FrequencyTest, EveryVertexHasTheNormalOfItsTexel) {
    const std::vector<std::uint8_t> texels = {200, 128, 220, 255, 60,  100, 200, 255,
                                              128, 40,  190, 255, 140, 210, 230, 255};
    for (const ShadingFrequency shading : {ShadingFrequency::Gouraud, ShadingFrequency::Flat})
        for (const bool behind : {false, true}) {
            WallImage images[3];
            for (const int way : {0, 1, 2}) {  // normals, a map, neither
                SetUp();
                const auto lamp = scene->create<PointLight>();
                scene->edit(lamp).set<&PointLight::intensity>(glm::vec3(6.0f));
                const Ref<Node> below = standing(root, lamp, {-0.6, 0.9, behind ? -1.0 : 1.0});
                const Ref<Material> of = glossy(ReflectionModel::BlinnPhong);
                scene->edit(of).set<&Material::doubleSided>(true);
                Mesh mesh = gridMesh(1.0f);
                if (way == 1) {
                    const Ref<Texture> map = checkerTexture(2, texels);
                    scene->edit(map).set<&Texture::magFilter>(FilterMode::Nearest);
                    scene->edit(of).set<&Material::normalTexture>(map);
                    for (glm::vec2& uv : mesh.texCoords) uv = uv * 0.5f + 0.25f;
                }
                if (way == 0)
                    for (std::size_t i = 0; i < 4; ++i)
                        mesh.normals[i] = glm::normalize(
                            glm::vec3(texels[4 * i], texels[4 * i + 1], texels[4 * i + 2]) / 127.5f - 1.0f);
                shaded(below, mesh, of, shading);
                View view = flatView(1.5, {16, 16});
                if (behind) {
                    view.eyeWorld = {0, 0, -10};
                    view.viewFromWorld = glm::dmat3(glm::rotate(glm::dmat4(1.0), 3.14159265358979, {0.0, 1.0, 0.0}));
                }
                images[way] = drawColour(wallViews(view));
                ASSERT_FALSE(images[way].values.empty());
            }
            EXPECT_GT(differingPixels(images[0], images[2]), 100u);
            for (std::size_t i = 0; i < images[0].values.size(); ++i)
                ASSERT_NEAR(images[0].values[i], images[1].values[i], 3e-6f + 2e-5f * images[0].values[i])
                    << static_cast<unsigned>(shading) << " " << behind << " at " << i;
        }
}

// A shadow's edge is the pixel's at every frequency, not the vertices'.
TEST_F(FrequencyTest, ShadowsOfGouraudAndFlatShadingAreThoseOfThePixels) {
    std::vector<WallImage> images;
    for (const ShadingFrequency shading :
         {ShadingFrequency::Phong, ShadingFrequency::Gouraud, ShadingFrequency::Flat}) {
        SetUp();
        const auto sun = scene->create<DirectionalLight>();
        const Ref<Node> below = lit(root, sun, {0, 0, -1}, glm::vec3(2.0f));
        const Ref<Material> of = material({1, 1, 1, 1}, ReflectionModel::Lambert);
        shaded(below, gridMesh(2.0f), of, shading);
        node(placed(below, {0, 0, 1}), geometry(gridMesh(0.5f), of));
        View view = lookAt({2.5, 0.3, 2.5}, {0, 0, 0}, 0.8, kWall);
        view.fits.push_back(fitSphere(sun.id, {0, 0, -1}, {0, 0, 0}, 3.0, 256));
        images.push_back(drawColour(wallViews(view)));
        ASSERT_FALSE(images.back().values.empty());
    }
    std::size_t dark = 0;
    for (std::size_t i = 0; i < images[0].values.size(); i += 4) {
        dark += images[0].values[i] == 0.0f && images[0].values[i + 3] == 1.0f;
        for (const std::size_t k : {1u, 2u}) EXPECT_NEAR(images[0].values[i], images[k].values[i], 2e-6f);
    }
    EXPECT_GT(dark, 20u);
}

// Light adds up: a picture under five lights with shadows is the sum of those under each alone. One travels by
// interpolants, five by the table, and both are what the vertices found.
TEST_F(FrequencyTest, AnyNumberOfShadowsIsShadedAtVertices) {
    constexpr int kLamps = 5;
    struct Case {
        ShadingFrequency shading;
        bool doubleSided, blended, textured;
    };
    const Case cases[] = {{ShadingFrequency::Gouraud, false, false, false},
                          {ShadingFrequency::Flat, true, false, false},
                          {ShadingFrequency::Gouraud, true, false, true},
                          {ShadingFrequency::Gouraud, false, true, true}};
    for (const Case& one : cases) {
        const auto pictureOf = [&](int first, int end) {
            SetUp();
            scene->edit(viewport).set<&Viewport::shadowColor>(glm::vec3(0.1f, 0.0f, 0.2f));
            const Ref<Material> of = glossy(ReflectionModel::Phong);
            scene->edit(of).set<&Material::emission>(glm::vec3(0.0f)).set<&Material::doubleSided>(one.doubleSided);
            if (one.blended)
                scene->edit(of)
                    .set<&Material::alphaMode>(AlphaMode::Blend)
                    .set<&Material::baseColour>(glm::vec4(0.5f, 0.3f, 0.2f, 0.6f));
            if (one.textured) scene->edit(of).set<&Material::baseColourTexture>(checkerTexture(16));
            View view = slanted();
            Ref<Node> below = root;
            for (int i = first; i < end; ++i) {
                const glm::vec3 travels(0.3f * float(i - 2), 0.2f * float(i % 3 - 1), -1);
                const auto sun = scene->create<DirectionalLight>();
                below = lit(below, sun, travels, glm::vec3(0.5f + 0.2f * float(i), 1.0f, 1.5f - 0.2f * float(i)));
                view.fits.push_back(fitSphere(sun.id, travels, {0, 0, 0}, 3.0, 256));
            }
            Mesh mesh = gridMesh(2.0f, 3);
            for (std::size_t i = 0; i < mesh.normals.size(); ++i)
                mesh.normals[i] = glm::normalize(mesh.positions[i] * 0.3f + glm::vec3(0, 0, 1));
            shaded(below, mesh, of, one.shading);
            node(placed(below, {0, 0, 1}), geometry(gridMesh(0.3f), material({0, 0, 0, 1}, ReflectionModel::Unlit)));
            return drawColour(wallViews(view), 2, 1);
        };
        const WallImage together = pictureOf(0, kLamps);
        ASSERT_FALSE(together.values.empty());
        EXPECT_NE(renderer->explain().find("vertex-shading vertex-table"), std::string::npos) << renderer->explain();
        std::vector<double> sum(together.values.size(), 0.0);
        for (int i = 0; i < kLamps; ++i) {
            const WallImage alone = pictureOf(i, i + 1);
            ASSERT_EQ(alone.values.size(), sum.size());
            EXPECT_EQ(renderer->explain().find("vertex-table"), std::string::npos);
            for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += static_cast<double>(alone.values[k]);
        }
        double worst = 0.0;
        std::size_t lit = 0;
        for (std::size_t k = 0; k < sum.size(); ++k) {
            if (k % 4 == 3) continue;  // alpha
            lit += sum[k] > 0.1;
            worst = std::max(worst, std::abs(static_cast<double>(together.values[k]) - sum[k]) / std::max(sum[k], 0.1));
        }
        EXPECT_GT(lit, 1000u);
        // A place in a triangle comes from its distance to the eye in float.
        EXPECT_LE(worst, 2e-5) << static_cast<unsigned>(one.shading) << one.doubleSided << one.blended << one.textured;
    }
}

TEST_F(FrequencyTest, TheTableIsTheSameOnEveryTile) {
    for (const ShadingFrequency shading : {ShadingFrequency::Gouraud, ShadingFrequency::Flat}) {
        SetUp();
        View view = slanted();
        Ref<Node> below = root;
        for (int i = 0; i < 5; ++i) {
            const auto sun = scene->create<DirectionalLight>();
            const glm::vec3 travels(0.2f * float(i), 0, -1);
            below = lit(below, sun, travels);
            view.fits.push_back(fitSphere(sun.id, travels, {0, 0, 0}, 3.0, 64));
        }
        const Ref<Material> of = glossy(ReflectionModel::BlinnPhong);
        for (const double x : {-0.8, 0.0, 0.9}) {
            const Ref<Geometry> box = geometry(boxMesh(glm::vec3(0.3f)), of);
            scene->edit(box).set<&Geometry::shading>(shading);
            node(placed(below, {x, 0.2 * x, 0.4}), box);
        }
        shaded(below, gridMesh(3.0f, 4), of, shading);
        const WallImage whole = drawColour(wallViews(view));
        ASSERT_FALSE(whole.values.empty());
        EXPECT_NE(renderer->explain().find("vertex-table"), std::string::npos);
        EXPECT_EQ(differingPixels(whole, drawColour(wallViews(view), 5, 3)), 0u);
    }
}

class FogTest : public IlluminationTest {
 protected:
    Ref<Fog> fogOf(FogMode mode, float start, float end, float density) {
        const Ref<Fog> fog = scene->create<Fog>();
        scene->edit(fog)
            .set<&Fog::mode>(mode)
            .set<&Fog::colour>(glm::vec3(0.2f, 0.4f, 0.8f))
            .set<&Fog::start>(start)
            .set<&Fog::end>(end)
            .set<&Fog::density>(density);
        scene->edit(viewport).set<&Viewport::fog>(fog);
        return fog;
    }
};

TEST_F(FogTest, EveryModeTakesTheEuclideanDistanceFromTheEye) {
    struct Law {
        FogMode mode;
        double (*share)(double);
    };
    const Law laws[] = {
        {FogMode::Linear, [](double d) { return std::clamp((5.0 - d) / 4.0, 0.0, 1.0); }},
        {FogMode::Quadratic, [](double d) { return std::pow(std::clamp((5.0 - d) / 4.0, 0.0, 1.0), 2.0); }},
        {FogMode::Exponential, [](double d) { return std::exp(-0.3 * d); }},
        {FogMode::SquaredExponential, [](double d) { return std::exp(-0.09 * d * d); }},
    };
    for (const Law& law : laws) {
        SetUp();
        fogOf(law.mode, 1.0f, 5.0f, 0.3f);
        plane(root, material({1.0f, 0.5f, 0.25f, 1.0f}, ReflectionModel::Unlit));
        const View view = slanted();
        const WallImage image = drawColour(wallViews(view));
        ASSERT_FALSE(image.values.empty());
        for (const glm::ivec2 pixel : {glm::ivec2(0, 0), glm::ivec2(24, 18), glm::ivec2(47, 35)}) {
            const double share = law.share(glm::distance(view.eyeWorld, onPlane(view, pixel.x, pixel.y)));
            EXPECT_NEAR(image.at(pixel.x, pixel.y)[0], share + 0.2 * (1 - share), 3e-6);
            EXPECT_NEAR(image.at(pixel.x, pixel.y)[2], 0.25 * share + 0.8 * (1 - share), 3e-6);
        }
    }
}

// Each surface is fogged by its own distance, then mixed; alpha is what it was.
TEST_F(FogTest, BlendedSurfacesAreFoggedBeforeTheyAreMixed) {
    fogOf(FogMode::Linear, 0.0f, 20.0f, 0.0f);
    plane(root, material({1, 1, 1, 1}, ReflectionModel::Unlit));
    const Ref<Material> glass = material({1.0f, 0.0f, 0.0f, 0.25f}, ReflectionModel::Unlit);
    scene->edit(glass).set<&Material::alphaMode>(AlphaMode::Blend);
    node(placed(root, {0, 0, 6}), geometry(gridMesh(5.0f), glass));
    const WallImage image = drawColour(wallViews(flatView(0.01, {9, 9})));  // the eye at z = 10
    ASSERT_FALSE(image.values.empty());
    const float* middle = image.at(4, 4);
    const double near = 0.8, far = 0.5;  // shares at 4 m and at 10 m
    EXPECT_NEAR(middle[0], 0.25 * (near + 0.2 * (1 - near)) + 0.75 * (far + 0.2 * (1 - far)), 1e-6);
    EXPECT_NEAR(middle[1], 0.25 * (0.4 * (1 - near)) + 0.75 * (far + 0.4 * (1 - far)), 1e-6);
    EXPECT_EQ(middle[3], 1.0f);
}

TEST_F(FogTest, BackgroundsStayAsTheyAre) {
    fogOf(FogMode::Exponential, 0.0f, 0.0f, 10.0f);
    const auto background = scene->create<ColourBackground>();
    scene->edit(background).set<&ColourBackground::colour>(glm::vec4(0.5f, 0.25f, 0.125f, 1.0f));
    scene->edit(viewport).set<&Viewport::background>(Ref<Container>(background.id));
    node(root, geometry(gridMesh(0.5f), material({1, 1, 1, 1}, ReflectionModel::Unlit)));
    const WallImage image = drawColour(wallViews(flatView(4.0, kWall)));
    ASSERT_FALSE(image.values.empty());
    EXPECT_EQ(image.at(1, 1)[0], 0.5f);
    EXPECT_NEAR(image.at(24, 18)[2], 0.8f, 1e-6f);  // exp(-100): nothing but fog
}

}  // namespace
}  // namespace umbriel
