#include "common/scene/deformed_bounds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/scene/core_types.h"
#include "common/scene/traversal.h"
#include "tests/support/random_scene.h"

namespace umbriel {
namespace {

class Deformed : public ::testing::Test {
 protected:
    Deformed() : aspect(registered(), ids) {}

    Ref<Geometry> geometry(const std::vector<glm::vec3>& positions, const std::vector<std::uint16_t>& joints = {},
                           const std::vector<glm::vec4>& weights = {}) {
        const auto made = aspect.create<Geometry>();
        aspect.edit(made)
            .assign<&Geometry::positions>(positions)
            .assign<&Geometry::joints>(joints)
            .assign<&Geometry::jointWeights>(weights);
        return made;
    }
    double number(double low, double high) {
        return low + (high - low) * static_cast<double>(random.next() >> 11) * 0x1p-53;
    }
    glm::dvec3 vector(double reach) { return {number(-reach, reach), number(-reach, reach), number(-reach, reach)}; }

    test::Random random{4711};
    TypeRegistry types;
    IdSource ids;
    Aspect aspect;

 private:
    const TypeRegistry& registered() {
        registerCoreTypes(types);
        return types;
    }
};

TEST_F(Deformed, BadWeightsAndJointsAreRepaired) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const auto made = geometry(std::vector<glm::vec3>(5), {0, 1, 2, 3, 9, 1, 0, 0, 9, 9, 9, 9, 1, 0, 0, 0, 1, 2, 0, 0},
                               {{1, 1, 1, 1}, {0.5f, 0.25f, 0, 0}, {1, 0, 0, 0}, {nan, -1, 0, 0}, {3, 1, 0, 0}});
    const std::vector<VertexJoints> used = vertexJointsOf(aspect.get(made), 4);
    ASSERT_EQ(used.size(), 5u);
    EXPECT_EQ(used[0].weights[3], 0.25f) << "scaled to a sum of 1";
    EXPECT_EQ(used[1].weights[0], 0.0f) << "joint 9 of 4 does not count";
    EXPECT_EQ(used[1].weights[1], 1.0f);
    EXPECT_EQ(used[2].weights[0], 1.0f) << "nothing left: the first joint";
    EXPECT_EQ(used[2].joints[0], 0);
    EXPECT_EQ(used[3].weights[0], 1.0f);
    EXPECT_EQ(used[3].joints[0], 0);
    EXPECT_EQ(used[4].weights[0], 0.75f);
    EXPECT_TRUE(vertexJointsOf(aspect.get(geometry({{1, 2, 3}}, {0}, {})), 4).empty()) << "not those of the vertices";
}

// Two points, one on each joint; joint 1 is turned by a quarter about z and moved.
TEST_F(Deformed, BoundsAreThoseOfEachJointsPoints) {
    const auto made = geometry({{1, 0, 0}, {0, 2, 0}}, {0, 0, 0, 0, 1, 0, 0, 0}, {{1, 0, 0, 0}, {1, 0, 0, 0}});
    const std::vector<Affine> maps{{glm::dmat3(1.0), {5, 0, 0}}, {{0, 1, 0, -1, 0, 0, 0, 0, 1}, {0, 0, 7}}};
    const Box3d box = deformedBoundsOf(aspect.get(made), 2).of(maps, {});
    for (int axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(box.lower[axis], (glm::dvec3(-2, 0, 0))[axis], 1e-4);
        EXPECT_NEAR(box.upper[axis], (glm::dvec3(6, 0, 7))[axis], 1e-4);
    }
}

// Whatever float arithmetic makes of it: random figures of random poses, each vertex in float.
TEST_F(Deformed, EveryVertexOfEveryPoseIsInside) {
    for (int scene = 0; scene < 300; ++scene) {
        const std::size_t jointCount = 1 + random.below(6);
        const std::size_t vertices = 1 + random.below(40);
        const std::size_t targets = random.below(4);
        const double size = std::exp2(number(-10, 10));
        std::vector<glm::vec3> positions(vertices);
        std::vector<std::uint16_t> joints(vertices * 4);
        std::vector<glm::vec4> weights(vertices);
        for (std::size_t v = 0; v < vertices; ++v) {
            positions[v] = glm::vec3(vector(size));
            for (std::size_t k = 0; k < 4; ++k) {
                joints[v * 4 + k] = static_cast<std::uint16_t>(random.below(jointCount));
                weights[v][static_cast<int>(k)] = static_cast<float>(std::max(0.0, number(-0.5, 1.0)));
            }
        }
        std::vector<glm::vec3> deltas(vertices * targets);
        for (glm::vec3& delta : deltas) delta = glm::vec3(vector(size));
        const auto made = geometry(positions, joints, weights);
        aspect.edit(made).assign<&Geometry::morphPositions>(deltas);
        std::vector<Affine> maps(jointCount);
        for (Affine& map : maps)
            map = {glm::dmat3(vector(2), vector(2), vector(2)), vector(size * std::exp2(number(-3, 6)))};
        std::vector<float> morphs(targets);
        for (float& weight : morphs) weight = static_cast<float>(number(-2, 2));

        const Box3d box = deformedBoundsOf(aspect.get(made), jointCount).of(maps, morphs);
        const std::vector<VertexJoints> used = vertexJointsOf(aspect.get(made), jointCount);
        const auto morph = aspect.create<MorphWeights>();
        aspect.edit(morph).assign<&MorphWeights::weights>(morphs);
        const auto core = aspect.create<DeformedGeometry>();
        aspect.edit(core).set<&DeformedGeometry::geometry>(made).set<&DeformedGeometry::morph>(morph);
        const std::vector<glm::dvec3> exact = deformedPositions(aspect, aspect.get(core), maps);
        ASSERT_EQ(exact.size(), vertices);
        for (std::size_t v = 0; v < vertices; ++v) {
            glm::vec3 p = positions[v];
            for (std::size_t t = 0; t < targets; ++t) p += deltas[t * vertices + v] * morphs[t];
            glm::vec3 place(0.0f);
            for (std::size_t k = 0; k < 4; ++k) {
                const Affine& map = maps[used[v].joints[k]];
                place += (glm::mat3(map.linear) * p + glm::vec3(map.translation)) * used[v].weights[k];
            }
            ASSERT_TRUE(box.contains(glm::dvec3(place))) << "scene " << scene << " vertex " << v;
            ASSERT_TRUE(box.contains(exact[v])) << "scene " << scene << " vertex " << v;
            // Coordinates and translations of up to 120 sizes, rounded two dozen times.
            ASSERT_LT(glm::length(glm::dvec3(place) - exact[v]), 24 * 0x1p-24 * 120 * std::sqrt(3.0) * size);
        }
    }
}

TEST_F(Deformed, AJointWithoutPlaceStandsAtTheAnchor) {
    const auto skin = aspect.create<Skin>();
    aspect.edit(skin).assign<&Skin::inverseBinds>(std::vector<glm::mat4>(2, glm::mat4(1.0f)));
    const double infinite = std::numeric_limits<double>::infinity();
    const std::vector<Affine> worlds{{glm::dmat3(infinite), {0, 0, 0}}, {glm::dmat3(2.0), {1e7, 0, 0}}};
    const std::vector<Affine> maps = jointMapsOf(aspect.get(skin), worlds, {1e7, 1, 0});
    EXPECT_EQ(maps[0], Affine());
    EXPECT_EQ(maps[1].translation, glm::dvec3(0, -1, 0));
}

// The world's bounds follow the joints, not the node that the figure hangs on.
TEST_F(Deformed, WorldBoundsFollowTheJoints) {
    const auto node = [&](Ref<Node> parent, ContainerId core) {
        const auto made = aspect.create<Node>();
        aspect.edit(made).set<&Node::core>(Ref<Container>(core));
        if (parent) aspect.edit(parent).append<&Node::children>(made);
        return made;
    };
    const auto root = node({}, {});
    const auto transform = aspect.create<Transform>();
    aspect.edit(transform).set<&Transform::translation>(glm::dvec3(1e6, 0, 0));
    const auto joint = node(root, transform.id);
    const auto skin = aspect.create<Skin>();
    aspect.edit(skin).assign<&Skin::joints>({joint}).assign<&Skin::inverseBinds>({glm::mat4(1.0f)});
    const auto made = geometry({{-1, -1, -1}, {1, 1, 1}}, std::vector<std::uint16_t>(8, 0),
                               std::vector<glm::vec4>(2, {1, 0, 0, 0}));
    aspect.edit(made).assign<&Geometry::morphPositions>({glm::vec3(0, 0, 0), glm::vec3(0, 4, 0)});
    const auto morph = aspect.create<MorphWeights>();
    const auto core = aspect.create<DeformedGeometry>();
    aspect.edit(core)
        .set<&DeformedGeometry::geometry>(made)
        .set<&DeformedGeometry::skin>(skin)
        .set<&DeformedGeometry::morph>(morph);
    const auto elsewhere = aspect.create<Transform>();
    aspect.edit(elsewhere).set<&Transform::translation>(glm::dvec3(0, 500, 0));
    node(node(root, elsewhere.id), core.id);

    GeometryBounds bounds;
    const auto expect = [&](const glm::dvec3& lower, const glm::dvec3& upper) {
        const Box3d box = worldBounds(aspect, root, bounds);
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_NEAR(box.lower[axis], lower[axis], 1e-4);
            EXPECT_NEAR(box.upper[axis], upper[axis], 1e-4);
        }
    };
    expect({1e6 - 1, -1, -1}, {1e6 + 1, 1, 1});
    aspect.edit(morph).assign<&MorphWeights::weights>({0.5f});
    expect({1e6 - 1, -1, -1}, {1e6 + 1, 3, 1});
    aspect.edit(transform).set<&Transform::translation>(glm::dvec3(2e6, 0, 0));
    expect({2e6 - 1, -1, -1}, {2e6 + 1, 3, 1});
    aspect.edit(core).set<&DeformedGeometry::skin>(Ref<Skin>());
    expect({-1, 499, -1}, {1, 503, 1});
}

}  // namespace
}  // namespace umbriel
