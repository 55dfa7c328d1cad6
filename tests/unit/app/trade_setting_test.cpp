#include "client/app/trade_setting.h"

#include <gtest/gtest.h>

#include "common/scene/core_types.h"

namespace umbriel {
namespace {

class Settings : public testing::Test {
 protected:
    Settings() {
        registerCoreTypes(types);
        window = scene.create<Window>();
        viewport = scene.create<Viewport>();
        scene.edit(window).append<&Window::viewports>(viewport);
    }
    const Viewport& now() const { return scene.get(viewport); }

    TypeRegistry types;
    IdSource ids;
    Aspect scene{types, ids};
    Ref<Window> window;
    Ref<Viewport> viewport;
};

TEST(Techniques, NameAModeAndItsFitOrWhatALightMapIsBakedFrom) {
    const auto plain = parseTechnique("light-map"), rays = parseTechnique("light-map:rays"),
               drawn = parseTechnique("light-map:ppcf"), fitted = parseTechnique("light-map:scene");
    ASSERT_TRUE(plain && rays && drawn && fitted);
    EXPECT_EQ(plain->mode, ShadowMode::LightMap);
    EXPECT_FALSE(plain->bakedFrom || plain->fit || rays->bakedFrom || rays->fit || fitted->bakedFrom || drawn->fit);
    EXPECT_EQ(drawn->mode, ShadowMode::LightMap);
    EXPECT_EQ(drawn->bakedFrom, ShadowMode::PercentageCloserSoft);
    EXPECT_EQ(fitted->fit, ShadowFitMode::Scene);
    EXPECT_EQ(parseTechnique("lisp:per-view")->fit, ShadowFitMode::PerView);
    for (const char* text : {"std:pcf", "std:rays", "light-map:lisp", "light-map:zfail",
                             "light-map:", "light-map:std:scene", "light-map:light-map", ":std", "wishes"})
        EXPECT_FALSE(parseTechnique(text)) << text;
    EXPECT_EQ(listOf("a,b:c,,d"), (std::vector<std::string>{"a", "b:c", "", "d"}));
    EXPECT_TRUE(listOf("").empty());
}

TEST_F(Settings, WhatOneSetsIsPutBackBeforeTheNext) {
    scene.edit(viewport).set<&Viewport::range>(0.4f).set<&Viewport::filterWidth>(3.0f);
    SettingSwitch settings(scene, window);
    ASSERT_TRUE(settings.apply({"trapez", 512, {}, {}, {{"range", "0.1"}, {"range", "0.2"}, {"maxSideAngle", "1"}}}));
    EXPECT_EQ(now().range.get(), 0.2f);
    EXPECT_EQ(now().maxSideAngle.get(), 1.0f);
    ASSERT_TRUE(settings.apply({"pcf:scene", 1024, 9.0, 4, {{"hardwareFilter", "true"}}}));
    EXPECT_EQ(now().range.get(), 0.4f);
    EXPECT_EQ(now().maxSideAngle.get(), 1.5f);
    EXPECT_EQ(now().filterWidth.get(), 9.0f);
    EXPECT_EQ(now().samplesPerRow.get(), 4u);
    EXPECT_TRUE(now().hardwareFilter.get());
    EXPECT_EQ(now().shadowFit.get(), ShadowFitMode::Scene);
    ASSERT_TRUE(settings.apply({"ppcf", 256, {}, 5, {}}));
    EXPECT_EQ(now().filterSamples.get(), 5u);
    EXPECT_EQ(now().samplesPerRow.get(), 6u);
    ASSERT_TRUE(settings.apply({"std", 128, {}, {}, {}}));
    EXPECT_EQ(now().shadowMode.get(), ShadowMode::Standard);
    EXPECT_EQ(now().mapSize.get(), 128u);
    EXPECT_EQ(now().shadowFit.get(), ShadowFitMode::Union);
    EXPECT_EQ(now().filterWidth.get(), 3.0f);
    EXPECT_EQ(now().filterSamples.get(), 8u);
    EXPECT_FALSE(now().hardwareFilter.get());
}

TEST_F(Settings, AFieldThatIsNotThereOrDoesNotFitIsRefused) {
    SettingSwitch settings(scene, window);
    EXPECT_FALSE(settings.apply({"std", 512, {}, {}, {{"magic", "1"}}}));
    EXPECT_FALSE(settings.apply({"std", 512, {}, {}, {{"range", "far"}}}));
    EXPECT_FALSE(settings.apply({"magic", 512, {}, {}, {}}));
    EXPECT_TRUE(settings.apply({"std", 512, {}, {}, {}}));
}

}  // namespace
}  // namespace umbriel
