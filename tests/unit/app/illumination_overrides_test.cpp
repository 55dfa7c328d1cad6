#include "client/app/illumination_overrides.h"

#include <gtest/gtest.h>

#include "common/light/shading_truth.h"
#include "common/scene/core_types.h"

namespace umbriel {
namespace {

class OverridesTest : public ::testing::Test {
 protected:
    OverridesTest() {
        registerCoreTypes(types);
        scene = std::make_unique<Aspect>(types, ids);
        material = scene->create<Material>("plastic");
        scene->edit(material)
            .set<&Material::baseColour>(glm::vec4(0.5f, 0.3f, 0.2f, 0.75f))
            .set<&Material::metallic>(0.0f)
            .set<&Material::roughness>(0.5f);
    }
    const Material& now() const { return scene->get(material); }

    TypeRegistry types;
    IdSource ids;
    std::unique_ptr<Aspect> scene;
    Ref<Material> material;
};

TEST_F(OverridesTest, TheSameModelAgainChangesNothing) {
    scene->commit();
    overrideModel(*scene, ReflectionModel::MetallicRoughness);
    EXPECT_TRUE(scene->commit().changed.empty());
}

TEST_F(OverridesTest, UnlitStaysUnlitAndAlphaStays) {
    const Ref<Material> sign = scene->create<Material>("sign");
    scene->edit(sign).set<&Material::model>(ReflectionModel::Unlit);
    overrideModel(*scene, ReflectionModel::Phong);
    EXPECT_EQ(scene->get(sign).model.get(), ReflectionModel::Unlit);
    EXPECT_EQ(now().model.get(), ReflectionModel::Phong);
    EXPECT_EQ(now().baseColour.get().w, 0.75f);
}

// The mirrored light turns twice as far as the half vector: a quarter of the exponent makes the same highlight.
TEST_F(OverridesTest, AHighlightKeepsItsWidthFromModelToModel) {
    overrideModel(*scene, ReflectionModel::BlinnPhong);
    const float blinn = now().shininess;
    EXPECT_NEAR(blinn, 2.0f / (0.25f * 0.25f) - 2.0f, 1e-4f);
    overrideModel(*scene, ReflectionModel::Phong);
    EXPECT_NEAR(now().shininess, blinn / 4, 1e-4f);
    overrideModel(*scene, ReflectionModel::TorranceSparrow);
    EXPECT_NEAR(now().roughness, 0.5f, 1e-4f);
}

// What every model makes of one material looks alike: straight on, diffuse light differs by the coat's 4 %, and by what
// is left of the highlight.
TEST_F(OverridesTest, TheDiffusePartOfEveryModelIsAboutTheSame) {
    ShadedPoint point;
    point.toEyeWorld = glm::normalize(glm::dvec3(1.5, 0.0, 1.0));  // beside every highlight but Schlick's long tail
    for (std::uint32_t i = 0; i < kEnumCount<ReflectionModel>; ++i) {
        const auto model = static_cast<ReflectionModel>(i);
        if (model == ReflectionModel::Unlit) continue;
        overrideModel(*scene, model);
        point.baseColour = glm::dvec3(glm::vec3(now().baseColour.get()));
        const glm::dvec3 back =
            reflectedTruth(now(), point, {0, 0, 1}) + (model == ReflectionModel::PhongOriginal
                                                           ? ambientTruth(now(), point.baseColour) / 3.14159
                                                           : glm::dvec3(0.0));
        EXPECT_NEAR(back.x * 3.14159, 0.5, 0.06) << i;
    }
}

TEST_F(OverridesTest, ShadingReachesEveryGeometry) {
    const auto geometry = scene->create<Geometry>();
    overrideShading(*scene, ShadingFrequency::Gouraud);
    EXPECT_EQ(scene->get(geometry).shading.get(), ShadingFrequency::Gouraud);
}

}  // namespace
}  // namespace umbriel
