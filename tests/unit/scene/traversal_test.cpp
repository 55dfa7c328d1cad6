#include "common/scene/traversal.h"

#include <gtest/gtest.h>

#include "common/scene/core_types.h"

namespace umbriel {
namespace {

class Traversal : public testing::Test {
 protected:
    Traversal() : aspect(registered(), ids) {}
    const TypeRegistry& registered() {
        registerCoreTypes(types);
        return types;
    }
    Ref<Node> node(Ref<Node> parent, Ref<Container> core = {}) {
        const auto made = aspect.create<Node>();
        aspect.edit(made).set<&Node::core>(core);
        if (parent) aspect.edit(parent).append<&Node::children>(made);
        return made;
    }
    Ref<Container> moved(const glm::dvec3& translation, const glm::mat3& linear = glm::mat3(1.0f)) {
        const auto transform = aspect.create<Transform>();
        aspect.edit(transform).set<&Transform::linear>(linear).set<&Transform::translation>(translation);
        return Ref<Container>(transform.id);
    }
    Ref<Container> triangle(float size) {
        const auto geometry = aspect.create<Geometry>();
        aspect.edit(geometry).assign<&Geometry::positions>(
            std::vector<glm::vec3>{{0, 0, 0}, {size, 0, 0}, {0, size, 0}});
        return Ref<Container>(geometry.id);
    }
    std::vector<ContainerId> visited(Ref<Node> root, const std::optional<glm::dvec3>& eye = std::nullopt) {
        std::vector<ContainerId> order;
        traverse(aspect, root, eye, [&](const VisitedNode& v) {
            order.push_back(v.ref);
            return Descend::Yes;
        });
        return order;
    }

    TypeRegistry types;
    IdSource ids;
    Aspect aspect;
};

TEST_F(Traversal, TransformsMultiplyDownThePathInDouble) {
    const Ref<Node> root = node({}, moved({1e6, 0, 0}));
    const Ref<Node> turned = node(root, moved({0, 1e-6, 0}, glm::mat3(0, 1, 0, -1, 0, 0, 0, 0, 1)));
    const Ref<Node> leaf = node(turned, moved({2, 0, 0}, glm::mat3(3.0f)));
    const Affine world = Hierarchy(aspect, root).worldFromNode(aspect, leaf);
    EXPECT_EQ(world.translation, glm::dvec3(1e6, 1e-6 + 2.0, 0));
    EXPECT_EQ(world.vector({1, 0, 0}), glm::dvec3(0, 3, 0));
    traverse(aspect, root, std::nullopt, [&](const VisitedNode& v) {
        if (v.ref == leaf) {
            EXPECT_EQ(v.worldFromNode, world);
        }
        return Descend::Yes;
    });
}

TEST_F(Traversal, NodesComeParentsFirstInTheOrderOfChildren) {
    const Ref<Node> root = node({});
    const Ref<Node> a = node(root), b = node(root), aa = node(a), ab = node(a), ba = node(b);
    EXPECT_EQ(visited(root), (std::vector<ContainerId>{root, a, aa, ab, b, ba}));
}

TEST_F(Traversal, HiddenNodesHideWhatIsBelow) {
    const Ref<Node> root = node({});
    const Ref<Node> a = node(root), b = node(root);
    node(a);
    aspect.edit(a).set<&Node::visible>(false);
    EXPECT_EQ(visited(root), (std::vector<ContainerId>{root, b}));
}

TEST_F(Traversal, SwitchesShowOneAllOrNone) {
    const auto choice = aspect.create<Switch>();
    const Ref<Node> root = node({}, Ref<Container>(choice.id));
    const Ref<Node> a = node(root), b = node(root);
    EXPECT_EQ(visited(root).size(), 3u);
    aspect.edit(choice).set<&Switch::choice>(1);
    EXPECT_EQ(visited(root), (std::vector<ContainerId>{root, b}));
    for (const std::int32_t none : {Switch::kNone, 2, -7}) {
        aspect.edit(choice).set<&Switch::choice>(none);
        EXPECT_EQ(visited(root).size(), 1u);
    }
    aspect.edit(choice).set<&Switch::choice>(0);
    EXPECT_EQ(visited(root), (std::vector<ContainerId>{root, a}));
}

TEST_F(Traversal, LevelsOfDetailFollowTheEye) {
    const auto levels = aspect.create<LevelOfDetail>();
    aspect.edit(levels).assign<&LevelOfDetail::ranges>(std::vector<float>{10.0f, 20.0f});
    const Ref<Node> placed = node({}, moved({100, 0, 0}));
    const Ref<Node> root = node(placed, Ref<Container>(levels.id));
    const Ref<Node> fine = node(root), middle = node(root), coarse = node(root);
    const auto shownFrom = [&](double x) { return visited(placed, glm::dvec3(x, 0, 0)).back(); };
    EXPECT_EQ(shownFrom(95), fine.id);
    EXPECT_EQ(shownFrom(90), middle.id);
    EXPECT_EQ(shownFrom(0), coarse.id);
    EXPECT_EQ(visited(placed).size(), 5u);
    EXPECT_EQ(chosenLevel(aspect.get(levels), 0, 1.0), -1);
    EXPECT_EQ(chosenLevel(aspect.get(levels), 5, 100.0), 4);
}

TEST_F(Traversal, CyclesAndNodesLinkedTwiceAreVisitedOnce) {
    const Ref<Node> root = node({}, moved({1, 0, 0}));
    const Ref<Node> a = node(root, moved({2, 0, 0})), b = node(root, moved({5, 0, 0}));
    aspect.edit(a).append<&Node::children>(root);
    aspect.edit(b).append<&Node::children>(a).append<&Node::children>(b).append<&Node::children>(
        Ref<Node>(ContainerId{999}));
    EXPECT_EQ(visited(root), (std::vector<ContainerId>{root, a, b}));
    const Hierarchy hierarchy(aspect, root);
    EXPECT_EQ(hierarchy.worldFromNode(aspect, a).translation.x, 3.0);
    EXPECT_EQ(hierarchy.worldFromNode(aspect, b).translation.x, 6.0);
    // A circle that no root leads to has a top, too.
    const Ref<Node> c = node({}, moved({1, 0, 0})), d = node(c, moved({1, 0, 0}));
    aspect.edit(d).append<&Node::children>(c);
    EXPECT_EQ(Hierarchy(aspect, root).worldFromNode(aspect, d).translation.x, 2.0);
}

TEST_F(Traversal, VeryDeepGraphsNeedNoStack) {
    const Ref<Container> step = moved({1, 0, 0});
    const Ref<Node> root = node({}, step);
    Ref<Node> last = root;
    for (int i = 0; i < 200000; ++i) last = node(last, step);
    EXPECT_EQ(visited(root).size(), 200001u);
    EXPECT_EQ(Hierarchy(aspect, root).worldFromNode(aspect, last).translation.x, 200001.0);
}

TEST_F(Traversal, BeaconsOutsideTheSceneStandOnTheirOwn) {
    const Ref<Node> root = node({});
    const Ref<Node> stand = node({}, moved({0, 7, 0}));
    const Ref<Node> beacon = node(stand, moved({1, 0, 0}, glm::mat3(2.0f)));
    const BeaconFrame frame = beaconFrame(aspect, Hierarchy(aspect, root), beacon);
    EXPECT_EQ(frame.positionWorld, glm::dvec3(1, 7, 0));
    EXPECT_EQ(frame.worldFromBeacon, glm::dmat3(1.0));
}

TEST_F(Traversal, BoundsAreThoseOfVisibleGeometryInTheWorld) {
    const Ref<Node> root = node({});
    const Ref<Container> shape = triangle(2.0f);
    node(node(root, moved({10, 0, 0})), shape);
    const Ref<Node> other = node(root, moved({-10, 0, 0}));
    node(other, shape);
    EXPECT_EQ(worldBounds(aspect, root), (Box3d{{-10, 0, 0}, {12, 2, 0}}));
    aspect.edit(other).set<&Node::visible>(false);
    EXPECT_EQ(worldBounds(aspect, root), (Box3d{{10, 0, 0}, {12, 2, 0}}));
    EXPECT_TRUE(worldBounds(aspect, other).empty());
    GeometryBounds bounds;
    aspect.edit(other).set<&Node::visible>(true);
    EXPECT_EQ(worldBounds(aspect, root, bounds, {other}), (Box3d{{10, 0, 0}, {12, 2, 0}}));
}

TEST_F(Traversal, KeptBoundsFollowEdits) {
    const Ref<Geometry> shape(triangle(2.0f).id);
    GeometryBounds bounds;
    EXPECT_EQ(bounds.of(aspect, shape).upper, glm::dvec3(2, 2, 0));
    aspect.edit(shape).setElement<&Geometry::positions>(1, glm::vec3(5, 0, -1));
    EXPECT_EQ(bounds.of(aspect, shape), (Box3d{{0, 0, -1}, {5, 2, 0}}));
    bounds.sweep();
    bounds.sweep();
    aspect.edit(shape).setElement<&Geometry::positions>(2, glm::vec3(NAN, 9, 9));
    EXPECT_EQ(bounds.of(aspect, shape), (Box3d{{0, 0, -1}, {5, 0, 0}}));
    aspect.destroy(shape);
    EXPECT_TRUE(bounds.of(aspect, shape).empty());
}

TEST_F(Traversal, LightsInEffectStandAtTheirBeacons) {
    const auto spot = aspect.create<SpotLight>();
    const Ref<Node> root = node({});
    const Ref<Node> first = node(root, Ref<Container>(spot.id));
    const Ref<Node> second = node(node(root, moved({3, 0, 0})), Ref<Container>(spot.id));
    const auto off = aspect.create<PointLight>();
    aspect.edit(off).set<&PointLight::on>(false);
    node(root, Ref<Container>(off.id));
    auto lights = lightsInEffect(aspect, root, Hierarchy(aspect, root));
    ASSERT_EQ(lights.size(), 2u);  // one core on two nodes is two lights
    EXPECT_EQ(lights[0].node, first);
    EXPECT_EQ(lights[1].node, second);
    EXPECT_EQ(lights[1].positionWorld, glm::dvec3(3, 0, 0));
    EXPECT_EQ(lights[1].directionWorld, glm::dvec3(0, 0, -1));
    // A quarter turn about y brings -z to -x.
    const Ref<Node> beacon = node(root, moved({0, 4, 0}, glm::mat3(0, 0, -1, 0, 1, 0, 1, 0, 0)));
    aspect.edit(spot).set<&SpotLight::beacon>(beacon);
    lights = lightsInEffect(aspect, root, Hierarchy(aspect, root), {second});
    ASSERT_EQ(lights.size(), 1u);
    EXPECT_EQ(lights[0].positionWorld, glm::dvec3(0, 4, 0));
    EXPECT_EQ(lights[0].directionWorld, glm::dvec3(-1, 0, 0));
}

}  // namespace
}  // namespace umbriel
