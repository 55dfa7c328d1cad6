#include "server/draw/scene_tree.h"

#include <gtest/gtest.h>

#include "common/scene/core_types.h"
#include "common/scene/lights.h"
#include "common/scene/materials.h"

namespace umbriel {
namespace {

class SceneTreeTest : public ::testing::Test {
 protected:
    SceneTreeTest() {
        registerCoreTypes(types);
        scene = std::make_unique<Aspect>(types, ids);
        root = scene->create<Node>();
    }
    template <class T>
    Ref<Node> node(Ref<Node> parent, Ref<T> core) {
        const Ref<Node> made = scene->create<Node>();
        scene->edit(made).template set<&Node::core>(Ref<Container>(core.id));
        scene->edit(parent).template append<&Node::children>(made);
        return made;
    }
    Ref<Transform> shift(double x) {
        const Ref<Transform> made = scene->create<Transform>();
        scene->edit(made).set<&Transform::translation>(glm::dvec3(x, 0, 0));
        return made;
    }

    TypeRegistry types;
    IdSource ids;
    std::unique_ptr<Aspect> scene;
    Ref<Node> root;
    SceneTree tree;
};

TEST_F(SceneTreeTest, TransformsMultiplyDownTheTreeAndMoveOnlyWhatIsBelow) {
    const auto outer = shift(1e6), inner = shift(2);
    const Ref<Node> a = node(root, outer);
    const Ref<Node> b = node(a, inner);
    node(b, scene->create<Geometry>());
    node(root, scene->create<Geometry>());
    tree.rebuild(*scene, root);
    ASSERT_EQ(tree.items().size(), 2u);
    const auto place = [&](std::size_t item) { return tree.entries()[tree.items()[item].entry].world.translation.x; };
    EXPECT_EQ(place(0), 1e6 + 2);
    EXPECT_EQ(place(1), 0.0);
    scene->edit(inner).set<&Transform::translation>(glm::dvec3(5, 0, 0));
    const ContainerId moved[] = {inner.id};
    tree.moved(*scene, moved);
    EXPECT_EQ(place(0), 1e6 + 5);
    EXPECT_EQ(place(1), 0.0);
    EXPECT_EQ(tree.placementOf(*scene, b)->translation.x, 1e6 + 5);
}

TEST_F(SceneTreeTest, LightsReachWhatIsBelowThem) {
    const Ref<Node> outer = node(root, scene->create<DirectionalLight>());
    const Ref<Node> inner = node(outer, scene->create<PointLight>());
    node(inner, scene->create<Geometry>());
    node(outer, scene->create<Geometry>());
    node(root, scene->create<Geometry>());
    tree.rebuild(*scene, root);
    ASSERT_EQ(tree.items().size(), 3u);
    const auto lights = [&](std::size_t item) { return tree.lightSets()[tree.items()[item].lightSet]; };
    EXPECT_EQ(lights(0), (std::vector<std::uint32_t>{0, 1}));
    EXPECT_EQ(lights(1), (std::vector<std::uint32_t>{0}));
    EXPECT_TRUE(lights(2).empty());
}

// A scene of a thousand lights says so once, not once a light.
TEST_F(SceneTreeTest, LightsBeyondTheMostAreCountedInOneWarning) {
    for (std::size_t i = 0; i < kMaxLights; ++i) node(root, scene->create<PointLight>());
    tree.rebuild(*scene, root);
    EXPECT_TRUE(tree.warnings().empty());
    for (int i = 0; i < 3; ++i) node(root, scene->create<SpotLight>());
    tree.rebuild(*scene, root);
    EXPECT_EQ(tree.lights().size(), kMaxLights);
    ASSERT_EQ(tree.warnings().size(), 1u);
    EXPECT_EQ(tree.warnings()[0], "of 259 lights the last 3 are left out: a scene has at most 256");
}

TEST_F(SceneTreeTest, TheInnermostMaterialGroupWinsOverTheGeometrysOwn) {
    const auto own = scene->create<Material>(), outer = scene->create<Material>(), inner = scene->create<Material>();
    const auto group = [&](Ref<Node> parent, Ref<Material> material) {
        const auto core = scene->create<MaterialGroup>();
        scene->edit(core).set<&MaterialGroup::material>(Ref<Container>(material.id));
        return node(parent, core);
    };
    const auto shape = scene->create<Geometry>();
    scene->edit(shape).set<&Geometry::material>(Ref<Container>(own.id));
    node(root, shape);
    const Ref<Node> a = group(root, outer);
    node(a, shape);
    node(group(a, inner), shape);
    tree.rebuild(*scene, root);
    ASSERT_EQ(tree.items().size(), 3u);
    EXPECT_EQ(tree.items()[0].material, own.id);
    EXPECT_EQ(tree.items()[1].material, outer.id);
    EXPECT_EQ(tree.items()[2].material, inner.id);
}

TEST_F(SceneTreeTest, SwitchesInvisibleNodesAndLevelsOfDetailHide) {
    const auto choice = scene->create<Switch>();
    scene->edit(choice).set<&Switch::choice>(1);
    const Ref<Node> switched = node(root, choice);
    node(switched, scene->create<Geometry>());
    const Ref<Node> chosen = node(switched, scene->create<Geometry>());
    const Ref<Node> gone = node(root, scene->create<Geometry>());
    scene->edit(gone).set<&Node::visible>(false);
    const auto detail = scene->create<LevelOfDetail>();
    scene->edit(detail).assign<&LevelOfDetail::ranges>(std::vector<float>{10.0f});
    const Ref<Node> levels = node(root, detail);
    const Ref<Node> fine = node(levels, scene->create<Geometry>());
    const Ref<Node> coarse = node(levels, scene->create<Geometry>());
    tree.rebuild(*scene, root);
    ASSERT_EQ(tree.items().size(), 3u);
    EXPECT_EQ(tree.items()[0].node, chosen.id);
    const auto hidden = [&](Ref<Node> which, double distance) {
        return tree.hiddenByDetail(*scene, {distance, 0, 0})[tree.rangeOf(which).first] != 0;
    };
    EXPECT_FALSE(hidden(fine, 5));
    EXPECT_TRUE(hidden(coarse, 5));
    EXPECT_TRUE(hidden(fine, 50));
    EXPECT_FALSE(hidden(coarse, 50));
}

TEST_F(SceneTreeTest, ACycleEnds) {
    const Ref<Node> a = node(root, shift(1));
    scene->edit(a).append<&Node::children>(root);
    tree.rebuild(*scene, root);
    EXPECT_EQ(tree.entries().size(), 2u);
    EXPECT_EQ(tree.warnings().size(), 1u);
}

}  // namespace
}  // namespace umbriel
