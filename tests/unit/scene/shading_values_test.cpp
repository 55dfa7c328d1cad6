#include "common/scene/shading_values.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/scene/core_types.h"
#include "common/scene/lights.h"
#include "common/scene/materials.h"
#include "common/scene/windows.h"

namespace umbriel {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

class ShadingValuesTest : public ::testing::Test {
 protected:
    ShadingValuesTest() {
        registerCoreTypes(types);
        scene = std::make_unique<Aspect>(types, ids);
    }
    TypeRegistry types;
    IdSource ids;
    std::unique_ptr<Aspect> scene;
};

TEST_F(ShadingValuesTest, ASoundSceneIsLeftAsItIs) {
    scene->create<Material>();
    scene->create<DirectionalLight>();
    scene->create<SpotLight>();
    const auto table = scene->create<IntensityTable>();
    scene->edit(table).set<&IntensityTable::columns>(1u).set<&IntensityTable::rows>(2u).assign<&IntensityTable::shares>(
        std::vector<float>{1.0f, 0.5f});
    scene->edit(scene->create<GoniometricLight>()).set<&GoniometricLight::table>(table);
    scene->create<Fog>();
    scene->commit();
    EXPECT_TRUE(repairShadingValues(*scene).empty());
    EXPECT_TRUE(scene->commit().changed.empty());
}

TEST_F(ShadingValuesTest, EachRepairNamesContainerFieldAndValue) {
    const auto steel = scene->create<Material>("steel");
    scene->edit(steel)
        .set<&Material::roughness>(-0.5f)
        .set<&Material::metallic>(kNan)
        .set<&Material::specular>(glm::vec3(0.5f, -1.0f, kInfinity))
        .set<&Material::shininess>(1e9f)
        .assign<&Material::lobeExponents>(std::vector<float>{3.0f, kNan});
    const auto lamp = scene->create<PointLight>();
    scene->edit(lamp).set<&PointLight::intensity>(glm::vec3(kNan, 2.0f, -3.0f));
    const auto fog = scene->create<Fog>("haze");
    scene->edit(fog).set<&Fog::density>(-1.0f);
    const std::vector<std::string> repairs = repairShadingValues(*scene);
    ASSERT_EQ(repairs.size(), 7u);
    std::string all;
    for (const std::string& repair : repairs) all += repair + "\n";
    for (const char* part : {"Material 'steel': its roughness -0.5 is out of range (0 to 1) and taken as 0",
                             "its metallic nan", "its specular -1", "its shininess 1000000000", "its lobeExponents nan",
                             "PointLight #", "its intensity nan", "Fog 'haze': its density -1"})
        EXPECT_NE(all.find(part), std::string::npos) << part << " in\n" << all;
    const Material& repaired = scene->get(steel);
    EXPECT_EQ(repaired.roughness.get(), 0.0f);
    EXPECT_EQ(repaired.metallic.get(), 1.0f) << "the default";
    EXPECT_EQ(repaired.specular.get(), glm::vec3(0.5f, 0.0f, 1e30f));
    EXPECT_EQ(repaired.shininess.get(), 1e6f);
    EXPECT_EQ(repaired.lobeExponents[1], 0.0f);
    EXPECT_EQ(scene->get(lamp).intensity.get(), glm::vec3(1.0f, 2.0f, 0.0f));
    EXPECT_TRUE(repairShadingValues(*scene).empty()) << "once is enough";
    EXPECT_EQ(scene->commit().created.size(), 3u);
}

TEST_F(ShadingValuesTest, AGoniometricLightWithoutAFittingTableIsReported) {
    const auto lamp = scene->create<GoniometricLight>("lamp");
    ASSERT_EQ(repairShadingValues(*scene).size(), 1u);
    const auto table = scene->create<IntensityTable>();
    scene->edit(table).set<&IntensityTable::columns>(2u).set<&IntensityTable::rows>(2u);
    scene->edit(lamp).set<&GoniometricLight::table>(table);
    const std::vector<std::string> repairs = repairShadingValues(*scene);
    ASSERT_EQ(repairs.size(), 1u);
    EXPECT_NE(repairs[0].find("GoniometricLight 'lamp' is dark"), std::string::npos) << repairs[0];
}

}  // namespace
}  // namespace umbriel
