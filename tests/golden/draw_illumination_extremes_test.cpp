#include "tests/golden/illumination_fixture.h"

namespace umbriel {
namespace {

constexpr ShadingFrequency kFrequencies[] = {ShadingFrequency::Phong, ShadingFrequency::Gouraud, ShadingFrequency::Flat,
                                             ShadingFrequency::FlatMean};

// A ball with everything: three kinds of light that move with it, and fog.
class SeamsTest : public IlluminationTest {
 protected:
    static Mesh ball() {
        Mesh mesh;
        constexpr int kRings = 7, kSegments = 12;
        for (int ring = 0; ring <= kRings; ++ring)
            for (int segment = 0; segment <= kSegments; ++segment) {
                const float polar = 3.14159265f * float(ring) / kRings;
                const float around = 2 * 3.14159265f * float(segment) / kSegments;
                const glm::vec3 n(std::sin(polar) * std::cos(around), std::cos(polar),
                                  -std::sin(polar) * std::sin(around));
                mesh.positions.push_back(n);
                mesh.normals.push_back(n);
                mesh.texCoords.push_back({float(segment) / kSegments, float(ring) / kRings});
            }
        for (std::uint32_t ring = 0; ring < kRings; ++ring)
            for (std::uint32_t segment = 0; segment < kSegments; ++segment) {
                const std::uint32_t a = ring * (kSegments + 1) + segment;
                const std::uint32_t below = a + kSegments + 1;
                for (const std::uint32_t index : {a, below, below + 1, a, below + 1, a + 1})
                    mesh.indices.push_back(index);
            }
        return mesh;
    }
    View build(ReflectionModel model, ShadingFrequency shading, std::optional<FogMode> fogMode, bool withShadow) {
        SetUp();
        const auto lamp = scene->create<PointLight>();
        scene->edit(lamp)
            .set<&PointLight::intensity>(glm::vec3(6.0f, 5.0f, 4.0f))
            .set<&PointLight::fade>(LightFade::Polynomial)
            .set<&PointLight::attenuation>(glm::vec3(0.5f, 0.1f, 0.2f));
        const auto spot = scene->create<SpotLight>();
        scene->edit(spot)
            .set<&SpotLight::intensity>(glm::vec3(9.0f))
            .set<&SpotLight::falloff>(SpotFalloff::Cone)
            .set<&SpotLight::exponent>(4.0f)
            .set<&SpotLight::outerAngle>(0.6f);
        const auto table = scene->create<IntensityTable>();
        scene->edit(table)
            .set<&IntensityTable::columns>(4u)
            .set<&IntensityTable::rows>(3u)
            .assign<&IntensityTable::shares>(std::vector<float>{1, 1, 1, 1, 0.7f, 0.2f, 0.5f, 0.1f, 0, 0, 0, 0});
        const auto web = scene->create<GoniometricLight>();
        scene->edit(web).set<&GoniometricLight::intensity>(glm::vec3(3.0f)).set<&GoniometricLight::table>(table);
        const auto sun = scene->create<DirectionalLight>();
        Ref<Node> below = standing(root, lamp, {-1.5, 1.8, 2.2});
        below = standing(below, spot, {2.5, 1.0, 2.0});
        below = standing(below, web, {0.3, -2.0, 2.0});
        below = lit(below, sun, {-0.4f, -0.7f, -0.6f}, glm::vec3(0.5f));
        const Ref<Material> of = glossy(model);
        for (const double x : {-0.9, 0.9}) {
            const Ref<Geometry> made = geometry(ball(), of);
            scene->edit(made).set<&Geometry::shading>(shading);
            node(placed(below, {x, 0.1, 0.3 * x}), made);
        }
        if (fogMode) {
            const auto fog = scene->create<Fog>();
            scene->edit(fog).set<&Fog::mode>(*fogMode).set<&Fog::end>(8.0f).set<&Fog::density>(0.1f);
            scene->edit(viewport).set<&Viewport::fog>(fog);
        }
        View view = lookAt({0.3, 0.8, 4.0}, {0.0, 0.1, 0.0}, 0.8, {93, 61});
        if (withShadow) view.fits.push_back(fitSphere(sun.id, {-0.4, -0.7, -0.6}, {0, 0, 0}, 3.0, 128));
        return view;
    }
    // Pixels of 3x2 tiles that are not those of one, bit for bit or as displayed.
    std::pair<std::size_t, std::size_t> seams(const View& view, TileMode mode) {
        const WallImage one = drawColour(wallViews(view, mode));
        const WallImage wall = drawColour(wallViews(view, mode), 3, 2);
        if (one.values.empty() || wall.values.size() != one.values.size()) return {SIZE_MAX, SIZE_MAX};
        std::size_t shown = 0;
        for (std::size_t i = 0; i < one.values.size(); i += 4) {
            bool differs = false;
            for (std::size_t k = 0; k < 4; ++k) differs |= encoded(one.values[i + k]) != encoded(wall.values[i + k]);
            shown += differs;
        }
        return {differingPixels(one, wall), shown};
    }
};

TEST_F(SeamsTest, EveryModelAndFrequencyIsBitEqualOnExactTilesAndShownAlikeOnOffsetTiles) {
    for (const ReflectionModel model : kAllModels)
        for (const ShadingFrequency shading : kFrequencies) {
            if (model != ReflectionModel::Phong && model != ReflectionModel::MetallicRoughness &&
                shading != ShadingFrequency::Phong && shading != ShadingFrequency::Gouraud)
                continue;
            const View view = build(model, shading, std::nullopt, shading == ShadingFrequency::Gouraud);
            const auto what = [&] {
                return "model " + std::to_string(unsigned(model)) + " frequency " + std::to_string(unsigned(shading));
            };
            EXPECT_EQ(seams(view, TileMode::Exact).first, 0u) << what();
            EXPECT_EQ(seams(view, TileMode::Offset).second, 0u) << what();
        }
}

TEST_F(SeamsTest, EveryFogIsBitEqualOnExactTilesAndShownAlikeOnOffsetTiles) {
    for (const FogMode mode :
         {FogMode::Linear, FogMode::Quadratic, FogMode::Exponential, FogMode::SquaredExponential}) {
        const View view = build(ReflectionModel::Schlick, ShadingFrequency::Phong, mode, true);
        EXPECT_EQ(seams(view, TileMode::Exact).first, 0u) << static_cast<unsigned>(mode);
        EXPECT_EQ(seams(view, TileMode::Offset).second, 0u) << static_cast<unsigned>(mode);
    }
}

class ExtremesTest : public IlluminationTest {
 protected:
    void expectFinite(const WallImage& image, const std::string& what) {
        ASSERT_FALSE(image.values.empty()) << what;
        std::size_t bad = 0;
        for (const float value : image.values) bad += !(std::isfinite(value) && value >= 0.0f);
        EXPECT_EQ(bad, 0u) << what;
    }
};

// Section 5 of the illumination spec, on the wall: every model, at every frequency, under lights in awkward places.
TEST_F(ExtremesTest, NothingIsEverNotFinite) {
    struct Place {
        const char* name;
        glm::dvec3 at;
    };
    const Place places[] = {
        {"on the surface", {0, 0, 0}},  {"a hair above", {0.1, 0.1, 1e-20}},     {"in the plane", {3, 0, 0}},
        {"at the eye", {0, -0.5, 2.0}}, {"opposite to the eye", {0, 0.5, -2.0}}, {"far away", {1e19, 0, 1e19}}};
    for (const ReflectionModel model : kAllModels)
        for (const Place& place : places) {
            SetUp();
            const auto lamp = scene->create<PointLight>();
            scene->edit(lamp).set<&PointLight::intensity>(glm::vec3(1e3f, 1e30f, 1e-30f));
            Ref<Node> below = standing(root, lamp, place.at);
            const auto product = scene->create<SpotLight>();
            scene->edit(product)
                .set<&SpotLight::falloff>(SpotFalloff::Product)
                .set<&SpotLight::exponent>(0.0f)
                .set<&SpotLight::attenuation>(glm::vec3(0.0f));
            below = standing(below, product, place.at);
            const auto cone = scene->create<SpotLight>();
            scene->edit(cone)
                .set<&SpotLight::falloff>(SpotFalloff::Cone)
                .set<&SpotLight::fade>(LightFade::Polynomial)
                .set<&SpotLight::attenuation>(glm::vec3(0.0f))
                .set<&SpotLight::exponent>(1e6f)
                .set<&SpotLight::outerAngle>(0.0f);
            below = standing(below, cone, place.at);
            int column = 0;
            for (const float shininess : {0.0f, 1.0f, 1e4f, 1e6f})
                for (const float roughness : {0.0f, 1.0f}) {
                    const Ref<Material> of = glossy(model);
                    scene->edit(of).set<&Material::shininess>(shininess).set<&Material::roughness>(roughness);
                    Mesh mesh = gridMesh(0.25f);
                    mesh.normals[0] = glm::vec3(0.0f);
                    mesh.normals[1] = glm::vec3(1e-30f, 0.0f, 0.0f);
                    mesh.normals[2] = glm::vec3(0.0f, 1e25f, 1e25f);
                    const Ref<Geometry> made = geometry(mesh, of);
                    scene->edit(made).set<&Geometry::shading>(kFrequencies[column % 4]);
                    node(placed(below, {-1.75 + 0.5 * column++, 0, 0}), made);
                }
            expectFinite(drawColour(wallViews(lookAt({0, -0.5, 2.0}, {0, 0, 0}, 1.2, kWall))),
                         "model " + std::to_string(unsigned(model)) + " light " + place.name);
        }
}

// kc = kl = kq = 0 gives 1; a cone of pi with exponent 0 is no spot: both are the light's own strength.
TEST_F(ExtremesTest, ALightWithoutAttenuationOrConeIsConstant) {
    const auto lamp = scene->create<SpotLight>();
    scene->edit(lamp)
        .set<&SpotLight::intensity>(glm::vec3(3.14159265f))
        .set<&SpotLight::falloff>(SpotFalloff::Cone)
        .set<&SpotLight::fade>(LightFade::Polynomial)
        .set<&SpotLight::attenuation>(glm::vec3(0.0f))
        .set<&SpotLight::exponent>(0.0f)
        .set<&SpotLight::outerAngle>(3.14159265f);
    plane(standing(root, lamp, {0, 0, 2}), material({1, 1, 1, 1}, ReflectionModel::Lambert));
    const WallImage image = drawColour(wallViews(flatView(4.0, {41, 41})));
    ASSERT_FALSE(image.values.empty());
    for (const int x : {0, 10, 20, 40}) {
        const double metres = (x + 0.5) / 41 * 4 - 2;
        EXPECT_NEAR(image.at(x, 20)[0], 2.0 / std::hypot(2.0, metres), 2e-6);
    }
}

// Radiance beyond half floats is not clamped on the way: pictures are in 32 bits.
TEST_F(ExtremesTest, RadianceKeepsItsRange) {
    for (const float irradiance : {1e-30f, 1.0f, 1e30f}) {
        SetUp();
        const auto sun = scene->create<DirectionalLight>();
        plane(lit(root, sun, {0, 0, -1}, glm::vec3(irradiance)), material({1, 1, 1, 1}, ReflectionModel::Lambert));
        const WallImage image = drawColour(wallViews(flatView(4.0, kWall)));
        ASSERT_FALSE(image.values.empty());
        EXPECT_NEAR(image.at(24, 18)[0] / irradiance, 0.31830988f, 1e-6f);
    }
}

// n.l = 0 exactly and a step to both sides: dark, dark, and as dark as the cosine.
TEST_F(ExtremesTest, TheTerminatorIsASharpAndContinuousEdge) {
    for (const float slope : {-1e-6f, 0.0f, 1e-6f}) {
        SetUp();
        const auto sun = scene->create<DirectionalLight>();
        plane(lit(root, sun, {1.0f, 0.0f, -slope}), material({1, 1, 1, 1}, ReflectionModel::PhongGated));
        const WallImage image = drawColour(wallViews(flatView(4.0, kWall)));
        ASSERT_FALSE(image.values.empty());
        if (slope > 0.0f)
            EXPECT_NEAR(image.at(24, 18)[0], 0.3183f * slope, 0.1f * slope);
        else
            EXPECT_EQ(image.at(24, 18)[0], 0.0f) << slope;
    }
}

}  // namespace
}  // namespace umbriel
