#include "common/scene/print.h"
#include "tests/golden/illumination_fixture.h"

namespace umbriel {
namespace {

class ModelsTest : public IlluminationTest {};

// Relative: positions of pixels come from float matrices (1e-6 of a metre over 3 m, in a lobe of exponent 20 four times
// that), the formulas add 2e-6 (docs/illumination.md, Numerics).
constexpr double kTolerance = 3e-5;

std::string nameOf(ReflectionModel model) {
    return "model " + std::to_string(static_cast<unsigned>(model));
}

TEST_F(ModelsTest, EveryModelDrawsItsFormulaUnderPointSunAndAmbientLight) {
    for (const ReflectionModel model : kAllModels) {
        SetUp();
        const auto lamp = scene->create<PointLight>();
        scene->edit(lamp).set<&PointLight::intensity>(glm::vec3(6.0f, 5.0f, 4.0f));
        const auto sun = scene->create<DirectionalLight>();
        const auto sky = scene->create<AmbientLight>();
        scene->edit(sky).set<&AmbientLight::radiance>(glm::vec3(0.1f, 0.2f, 0.4f));
        const Ref<Node> below = node(lit(standing(root, lamp, {-0.5, 0.8, 1.2}), sun, {0.3f, 0.5f, -1.0f}), sky);
        const Ref<Material> of = glossy(model);
        plane(below, of);
        const View view = slanted();
        expectTruth(drawColour(wallViews(view)), view, scene->get(of), kTolerance, nameOf(model));
    }
}

// The ungated models have highlights of lights behind the surface, the others are dark.
TEST_F(ModelsTest, OnlyUngatedModelsSeeALightBehindTheSurface) {
    for (const ReflectionModel model : kAllModels) {
        if (model == ReflectionModel::Unlit) continue;
        SetUp();
        const auto lamp = scene->create<PointLight>();
        scene->edit(lamp).set<&PointLight::intensity>(glm::vec3(9.0f));
        const Ref<Material> of = glossy(model);
        scene->edit(of).set<&Material::emission>(glm::vec3(0.0f)).set<&Material::shininess>(0.0f);
        plane(standing(root, lamp, {0, 0, -1.0}), of);
        const WallImage image = drawColour(wallViews(slanted()));
        ASSERT_FALSE(image.values.empty());
        const bool isUngated = model == ReflectionModel::Phong || model == ReflectionModel::GeneralSum ||
                               model == ReflectionModel::PhongOriginal;
        EXPECT_EQ(image.at(24, 18)[0] > 0.0f, isUngated) << nameOf(model);
    }
}

TEST_F(ModelsTest, LafortuneLobesWithAGrainFollowTheTangents) {
    const auto lamp = scene->create<PointLight>();
    scene->edit(lamp).set<&PointLight::intensity>(glm::vec3(6.0f));
    const Ref<Material> of = glossy(ReflectionModel::Lafortune);
    scene->edit(of).assign<&Material::lobeAxes>(std::vector<glm::vec3>{{-1.0f, -0.3f, 0.9f}, {0.0f, 0.8f, 0.5f}});
    plane(standing(root, lamp, {-0.5, 0.8, 1.2}), of);  // u runs along +x
    const View view = slanted();
    expectTruth(drawColour(wallViews(view)), view, scene->get(of), kTolerance, "grain");
}

TEST_F(ModelsTest, OpenGlsTextureDimsTheHighlightTooAndTheOthersOnlyTheDiffusePart) {
    const auto textured = [&](ReflectionModel model) {
        SetUp();
        const auto sun = scene->create<DirectionalLight>();
        const Ref<Material> of = glossy(model);
        // Black texels: what is left is not dimmed by them.
        const Ref<Texture> black = checkerTexture(1, {0, 0, 0, 255});
        scene->edit(of).set<&Material::baseColourTexture>(black).set<&Material::emission>(glm::vec3(0.0f));
        plane(lit(root, sun, {0, 0, -1}), of);
        const WallImage image = drawColour(wallViews(flatView(4.0, kWall)));
        return image.values.empty() ? -1.0f : image.at(24, 18)[2];
    };
    EXPECT_NEAR(textured(ReflectionModel::BlinnPhong), 0.5f / 3.14159265f, 1e-6f);
    EXPECT_EQ(textured(ReflectionModel::OpenGlSum), 0.0f);
}

// A group's material replaces those below it, model and all; the innermost wins.
TEST_F(ModelsTest, AMaterialGroupGivesItsModelToWhatIsBelow) {
    const auto lamp = scene->create<PointLight>();
    scene->edit(lamp).set<&PointLight::intensity>(glm::vec3(6.0f));
    const Ref<Material> own = glossy(ReflectionModel::Unlit);
    const Ref<Material> outer = glossy(ReflectionModel::Lambert);
    const Ref<Material> inner = glossy(ReflectionModel::Schlick);
    const auto group = [&](Ref<Node> parent, Ref<Material> of) {
        const auto made = scene->create<MaterialGroup>();
        scene->edit(made).set<&MaterialGroup::material>(Ref<Container>(of.id));
        return node(parent, made);
    };
    const Ref<Node> below = standing(root, lamp, {-0.5, 0.8, 1.2});
    plane(group(group(below, outer), inner), own);
    const View view = slanted();
    expectTruth(drawColour(wallViews(view)), view, scene->get(inner), kTolerance, "inner group");
    // Changing the group's material by a field reaches the picture.
    scene->edit(inner).set<&Material::model>(ReflectionModel::TorranceSparrow);
    expectTruth(drawColour(wallViews(view)), view, scene->get(inner), kTolerance, "changed group");
}

TEST_F(ModelsTest, EveryLightFormArrivesAsItsFormulaSays) {
    struct Form {
        const char* name;
        std::function<Ref<Node>(Ref<Node>)> add;
    };
    const glm::dvec3 at(-0.4, 0.5, 1.5);
    const auto spot = [&](Ref<Node> parent, SpotFalloff falloff, float exponent, LightFade fade, float outer) {
        const auto made = scene->create<SpotLight>();
        scene->edit(made)
            .set<&SpotLight::intensity>(glm::vec3(4.0f, 5.0f, 6.0f))
            .set<&SpotLight::falloff>(falloff)
            .set<&SpotLight::exponent>(exponent)
            .set<&SpotLight::innerAngle>(0.2f)
            .set<&SpotLight::outerAngle>(outer)
            .set<&SpotLight::fade>(fade)
            .set<&SpotLight::attenuation>(glm::vec3(0.3f, 0.1f, 0.2f));
        return standing(parent, made, at);
    };
    const std::vector<Form> forms = {
        {"point, polynomial",
         [&](Ref<Node> parent) {
             const auto made = scene->create<PointLight>();
             scene->edit(made)
                 .set<&PointLight::intensity>(glm::vec3(2.0f))
                 .set<&PointLight::fade>(LightFade::Polynomial)
                 .set<&PointLight::attenuation>(glm::vec3(0.2f, 0.1f, 0.3f));
             return standing(parent, made, at);
         }},
        {"spot, edge", [&](Ref<Node> p) { return spot(p, SpotFalloff::Edge, 1, LightFade::InverseSquare, 1.2f); }},
        {"spot, cone", [&](Ref<Node> p) { return spot(p, SpotFalloff::Cone, 8, LightFade::InverseSquare, 3.1f); }},
        {"spot, cone, polynomial",
         [&](Ref<Node> p) { return spot(p, SpotFalloff::Cone, 3, LightFade::Polynomial, 1.5f); }},
        {"spot, product", [&](Ref<Node> p) { return spot(p, SpotFalloff::Product, 8, LightFade::Polynomial, 0.3f); }},
        {"three colours",
         [&](Ref<Node> parent) {
             const auto made = scene->create<PointLight>();
             scene->edit(made)
                 .set<&PointLight::intensity>(glm::vec3(2.0f))
                 .set<&PointLight::ambientShare>(glm::vec3(0.5f, 0.1f, 0.0f))
                 .set<&PointLight::highlightShare>(glm::vec3(0.1f, 0.5f, 1.5f));
             return standing(parent, made, at);
         }},
    };
    for (const Form& form : forms) {
        for (const ReflectionModel model : {ReflectionModel::GeneralSum, ReflectionModel::TorranceSparrow}) {
            SetUp();
            const Ref<Material> of = glossy(model);
            plane(form.add(root), of);
            const View view = slanted();
            expectTruth(drawColour(wallViews(view)), view, scene->get(of), kTolerance, form.name);
        }
    }
}

TEST_F(ModelsTest, AConeCutsTheExponentsSpot) {
    const auto made = scene->create<SpotLight>();
    scene->edit(made)
        .set<&SpotLight::intensity>(glm::vec3(4.0f))
        .set<&SpotLight::falloff>(SpotFalloff::Cone)
        .set<&SpotLight::exponent>(2.0f)
        .set<&SpotLight::outerAngle>(0.5f);
    plane(standing(root, made, {0, 0, 2}), material({1, 1, 1, 1}, ReflectionModel::Lambert));
    const WallImage image = drawColour(wallViews(flatView(4.0, kWall)));
    ASSERT_FALSE(image.values.empty());
    const double edge = 2.0 * std::tan(0.5);  // metres from the axis
    for (int x = 24; x < 48; ++x) {
        const double metres = glm::length(glm::dvec2((x + 0.5) / 48 * 4 - 2, 0.5 / 36 * 3));
        if (std::abs(metres - edge) < 1e-3) continue;
        EXPECT_EQ(image.at(x, 18)[0] > 0.0f, metres < edge) << x;
    }
}

// A table that tells left from right and up from down, seen through a beacon that is turned about its axis.
TEST_F(ModelsTest, AGoniometricLightShinesAsItsTableSaysInItsBeaconsFrame) {
    const auto table = scene->create<IntensityTable>();
    std::vector<float> shares;
    for (int row = 0; row < 37; ++row)
        for (int column = 0; column < 12; ++column)
            // Straight down all planes meet, as in a real luminaire.
            shares.push_back(row == 0 ? 0.4f : float((row * 7 + column * column * 3 + row * column) % 101) / 101.0f);
    scene->edit(table)
        .set<&IntensityTable::columns>(12u)
        .set<&IntensityTable::rows>(37u)
        .assign<&IntensityTable::shares>(shares);
    const auto lamp = scene->create<GoniometricLight>();
    const glm::mat3 turned =
        lookingAlong({0.2f, -0.3f, -1.0f}) * glm::mat3(glm::rotate(glm::mat4(1.0f), 0.7f, glm::vec3(0, 0, 1)));
    const Ref<Node> beacon = placed(root, {-0.4, 0.5, 1.5}, turned);
    scene->edit(lamp)
        .set<&GoniometricLight::intensity>(glm::vec3(3.0f, 2.0f, 1.0f))
        .set<&GoniometricLight::table>(table)
        .set<&GoniometricLight::beacon>(beacon);
    const Ref<Material> of = glossy(ReflectionModel::Lambert);
    plane(node(root, lamp), of);
    const View view = slanted();
    expectTruth(drawColour(wallViews(view)), view, scene->get(of), 1e-4, "table");
    EXPECT_NE(renderer->explain().find("goniometric"), std::string::npos);
    // A table that is not of its size is no table: the lamp is dark, the rest goes on.
    scene->edit(table).set<&IntensityTable::rows>(36u);
    const WallImage dark = drawColour(wallViews(view));
    ASSERT_FALSE(dark.values.empty());
    EXPECT_EQ(dark.at(24, 18)[0], 0.01f);  // its emission
}

}  // namespace
}  // namespace umbriel
