#include "client/app/shadow_panel.h"

#include <gtest/gtest.h>

#include <optional>
#include <set>

#include "client/session/field_text.h"
#include "common/scene/core_types.h"

namespace umbriel {
namespace {

class ShadowPanelTest : public ::testing::Test {
 protected:
    ShadowPanelTest() {
        registerCoreTypes(types);
        scene.emplace(types, ids);
        window = scene->create<Window>();
        viewport = scene->create<Viewport>();
        other = scene->create<Viewport>();
        scene->edit(window).append<&Window::viewports>(viewport).append<&Window::viewports>(other);
    }
    static void choose(ShadowPanel& panel, std::string_view field) {
        for (int i = 0; i < 100 && panel.field() != field; ++i) panel.choose(1);
        ASSERT_EQ(panel.field(), field);
    }

    TypeRegistry types;
    IdSource ids;
    std::optional<Aspect> scene;
    Ref<Window> window;
    Ref<Viewport> viewport, other;
};

TEST_F(ShadowPanelTest, EveryFieldOfTheShadowsThatHasATextIsThere) {
    ShadowPanel panel(*scene, window, viewport);
    std::set<std::string, std::less<>> there;
    while (there.insert(std::string(panel.field())).second) panel.choose(1);
    bool isShadow = false;
    std::size_t lists = 0;
    for (const FieldDescriptor& field : scene->get(viewport).type().fields) {
        isShadow = isShadow || field.name == "shadowMode";
        if (!isShadow) continue;
        if (field.isMulti)
            ++lists;
        else if (field.kind != ElementKind::Id)  // lightMap
            EXPECT_TRUE(there.count(field.name)) << field.name;
    }
    EXPECT_EQ(lists, 2u) << "lightNodes and excludeNodes";
    panel.choose(-1);
    EXPECT_TRUE(there.count(panel.field()));
}

TEST_F(ShadowPanelTest, TheTextOfAFieldSetsItAgain) {
    scene->edit(viewport)
        .set<&Viewport::shadowColor>(glm::vec3(0.1f, 0.7f, 1e-7f))
        .set<&Viewport::planeNormal>(glm::dvec3(0.1, 1.0 / 3.0, -7e10))
        .set<&Viewport::shadowMode>(ShadowMode::Blob)
        .set<&Viewport::reuseMaps>(false);
    for (const FieldDescriptor& field : scene->get(viewport).type().fields) {
        const auto text = fieldText(*scene, viewport, field.name);
        if (!text) continue;
        const auto set = setField(*scene, other, field.name, *text);
        EXPECT_TRUE(set) << field.name << " " << *text;
        EXPECT_EQ(fieldText(*scene, other, field.name), text);
    }
    EXPECT_EQ(scene->get(other).planeNormal.get(), scene->get(viewport).planeNormal.get());
    EXPECT_EQ(scene->get(other).shadowColor.get(), scene->get(viewport).shadowColor.get());
}

TEST_F(ShadowPanelTest, StepsAndTypedValuesGoToAllViewports) {
    ShadowPanel panel(*scene, window, viewport);
    choose(panel, "mapSize");
    panel.step(1);
    EXPECT_EQ(scene->get(other).mapSize.get(), 1024u);
    choose(panel, "shadowMode");
    panel.step(1);
    EXPECT_EQ(scene->get(other).shadowMode.get(), ShadowMode::Standard);
    panel.step(-2);  // past none, over the modes that this version does not have
    EXPECT_EQ(scene->get(other).shadowMode.get(), ShadowMode::Cube);
    panel.type("zfail");
    panel.set();
    EXPECT_EQ(scene->get(other).shadowMode.get(), ShadowMode::VolumeZFail);
    choose(panel, "gauss");
    panel.type("4.2x5");
    panel.erase();
    panel.erase();
    panel.type("5");
    panel.set();
    EXPECT_EQ(scene->get(other).gauss.get(), 4.25f);
    panel.step(1);
    EXPECT_FLOAT_EQ(scene->get(other).gauss.get(), 4.25f * 1.25f);
    choose(panel, "shadowColor");
    panel.type("0.5,0,1");
    panel.set();
    EXPECT_EQ(scene->get(viewport).shadowColor.get(), glm::vec3(0.5f, 0.0f, 1.0f));
    panel.type("blue");
    panel.set();
    EXPECT_NE(panel.message().find("three numbers"), std::string::npos) << panel.message();
    EXPECT_EQ(scene->get(viewport).shadowColor.get(), glm::vec3(0.5f, 0.0f, 1.0f));
}

TEST_F(ShadowPanelTest, WhatCannotBeDrawnIsTakenBack) {
    ShadowPanel panel(*scene, window, viewport);
    choose(panel, "mapSize");
    panel.type("77");
    panel.set();
    panel.refuse("no such thing");
    EXPECT_EQ(scene->get(viewport).mapSize.get(), 512u);
    EXPECT_EQ(panel.message(), "no such thing");
}

TEST_F(ShadowPanelTest, LinesShowTheChosenFieldWhileOpen) {
    ShadowPanel panel(*scene, window, viewport);
    panel.show();
    EXPECT_EQ(scene->get(viewport).foregrounds.size(), 0u) << "closed, it costs nothing";
    panel.toggle();
    choose(panel, "show");
    panel.type("edge-map");
    panel.set();
    panel.show();
    const auto texts = [&] {
        std::string all;
        for (const Ref<Container>& each : scene->get(viewport).foregrounds.toVector())
            all += scene->findAs<TextForeground>(each.id)->text.get() + "\n";
        return all;
    };
    EXPECT_NE(texts().find("> show = edge-map\n"), std::string::npos) << texts();
    EXPECT_NE(texts().find("  showLight = 0\n"), std::string::npos) << texts();
    panel.toggle();
    panel.show();
    EXPECT_EQ(texts().find_first_not_of('\n'), std::string::npos);
}

}  // namespace
}  // namespace umbriel
