#include "client/import/procedural.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "common/scene/cameras.h"
#include "common/scene/core_types.h"
#include "common/scene/materials.h"
#include "common/scene/traversal.h"

namespace umbriel {
namespace {

class Demos : public testing::TestWithParam<const char*> {
 protected:
    Demos() { registerCoreTypes(_types); }
    TypeRegistry _types;
};

struct Counts {
    std::size_t drawnTriangles = 0;
    std::size_t storedTriangles = 0;
    std::size_t drawnNodes = 0;
    std::map<ContainerId, int> uses;  // of a geometry
};

Counts count(const Aspect& aspect, Ref<Node> root) {
    Counts counts;
    traverse(aspect, root, std::nullopt, [&](const VisitedNode& visited) {
        if (visited.core && isA<Geometry>(*visited.core)) {
            const std::size_t triangles = static_cast<const Geometry&>(*visited.core).indices.size() / 3;
            counts.drawnTriangles += triangles;
            ++counts.drawnNodes;
            if (++counts.uses[visited.core->id()] == 1) counts.storedTriangles += triangles;
        }
        return Descend::Yes;
    });
    return counts;
}

// Shared normals may lean away from a triangle at a sharp edge of a smooth surface, but their mean must not: that is a
// triangle wound the wrong way round.
TEST_P(Demos, TrianglesFaceTheWayOfTheirNormals) {
    IdSource ids;
    Aspect aspect(_types, ids);
    ASSERT_TRUE(buildDemo(GetParam(), aspect));
    for (ContainerId id : aspect.ids()) {
        const auto* geometry = aspect.findAs<Geometry>(id);
        if (!geometry) continue;
        const std::vector<glm::vec3> positions = geometry->positions.toVector();
        const std::vector<glm::vec3> normals = geometry->normals.toVector();
        const std::vector<std::uint32_t> indices = geometry->indices.toVector();
        ASSERT_EQ(normals.size(), positions.size());
        ASSERT_EQ(indices.size() % 3, 0u);
        for (std::uint32_t index : indices) ASSERT_LT(index, positions.size());
        for (const glm::vec3& normal : normals) ASSERT_NEAR(glm::length(normal), 1.0f, 1e-4f) << geometry->name.get();
        std::size_t wrong = 0;
        for (std::size_t i = 0; i < indices.size(); i += 3) {
            const glm::vec3 face = glm::cross(positions[indices[i + 1]] - positions[indices[i]],
                                              positions[indices[i + 2]] - positions[indices[i]]);
            if (glm::length(face) < 1e-9f) continue;
            const glm::vec3 mean = normals[indices[i]] + normals[indices[i + 1]] + normals[indices[i + 2]];
            if (glm::dot(face, mean) <= 0.0f) ++wrong;
        }
        EXPECT_EQ(wrong, 0u) << geometry->name.get() << " of " << indices.size() / 3;
    }
}

TEST_P(Demos, AttributesAreCompleteAndFinite) {
    IdSource ids;
    Aspect aspect(_types, ids);
    const auto scene = buildDemo(GetParam(), aspect);
    ASSERT_TRUE(scene);
    for (ContainerId id : aspect.ids()) {
        if (const auto* image = aspect.findAs<Image>(id)) {
            EXPECT_EQ(image->texels.size(), std::size_t{3} * image->width * image->height);
        }
        const auto* geometry = aspect.findAs<Geometry>(id);
        if (!geometry) continue;
        const std::size_t size = geometry->positions.size();
        EXPECT_TRUE(geometry->tangents.empty() || geometry->tangents.size() == size);
        EXPECT_TRUE(geometry->colours.empty() || geometry->colours.size() == size);
        EXPECT_TRUE(geometry->texCoords0.empty() || geometry->texCoords0.size() == size);
        for (const glm::vec3& p : geometry->positions.toVector()) ASSERT_TRUE(isFinite(glm::dvec3(p)));
        const std::vector<glm::vec3> normals = geometry->normals.toVector();
        const std::vector<glm::vec4> tangents = geometry->tangents.toVector();
        for (std::size_t i = 0; i < tangents.size(); ++i) {
            ASSERT_NEAR(glm::length(glm::vec3(tangents[i])), 1.0f, 1e-4f);
            ASSERT_NEAR(glm::dot(glm::vec3(tangents[i]), normals[i]), 0.0f, 1e-4f);
            ASSERT_EQ(std::abs(tangents[i].w), 1.0f);
        }
        const auto* material = aspect.findAs<Material>(geometry->material.get());
        ASSERT_NE(material, nullptr);
        if (material->normalTexture.get()) {
            EXPECT_FALSE(tangents.empty()) << geometry->name.get();
        }
        if (material->baseColourTexture.get()) {
            EXPECT_FALSE(geometry->texCoords0.empty()) << geometry->name.get();
        }
    }
    EXPECT_FALSE(worldBounds(aspect, aspect.get(*scene).root).empty());
}

TEST_P(Demos, HaveAMainCameraAndASun) {
    IdSource ids;
    Aspect aspect(_types, ids);
    const auto loaded = buildDemo(GetParam(), aspect);
    ASSERT_TRUE(loaded);
    const LoadedScene& scene = aspect.get(*loaded);
    ASSERT_FALSE(scene.cameras.empty());  // the first is the one that is taken
    const auto* camera = aspect.findAs<PerspectiveCamera>(scene.cameras[0]);
    ASSERT_NE(camera, nullptr);
    EXPECT_EQ(camera->name.get(), "main");
    const Hierarchy hierarchy(aspect, scene.root);
    int suns = 0;
    for (const LightInEffect& light : lightsInEffect(aspect, scene.root, hierarchy))
        if (light.kind == LightKind::Directional && light.castsShadow) {
            ++suns;
            EXPECT_LT(light.directionWorld.y, -0.3);
        }
    EXPECT_EQ(suns, 1);
}

TEST_P(Demos, AreTheSameEveryTime) {
    IdSource idsA;
    Aspect a(_types, idsA);
    IdSource idsB;
    Aspect b(_types, idsB);
    ASSERT_TRUE(buildDemo(GetParam(), a));
    ASSERT_TRUE(buildDemo(GetParam(), b));
    EXPECT_TRUE(a.equals(b));
}

INSTANTIATE_TEST_SUITE_P(All, Demos,
                         testing::Values("demo:car", "demo:city?n=300", "demo:cloth", "demo:palms", "demo:palms?n=40",
                                         "demo:palms?triangles=2602",
                                         "demo:spheres?n=10",
                                         "demo:spheres?n=1"));

// One scene, and its counts.
class DemoFigures : public Demos {
 protected:
    void build(const std::string& uri) {
        const auto loaded = buildDemo(uri, aspect);
        ASSERT_TRUE(loaded);
        scene = &aspect.get(*loaded);
        counts = count(aspect, scene->root);
    }
    IdSource ids;
    Aspect aspect{_types, ids};
    const LoadedScene* scene = nullptr;
    Counts counts;
};

TEST_F(DemoFigures, CityHasSharedGeometriesAndTheTrianglesItPromises) {
    ASSERT_NO_FATAL_FAILURE(build("demo:city"));
    std::size_t buildings = 0;
    for (ContainerId id : aspect.ids())
        if (const auto* node = aspect.findAs<Node>(id);
            node && node->name.get() == "building" && !node->children.empty())
            ++buildings;
    EXPECT_EQ(buildings, 2000u);
    EXPECT_GT(counts.drawnTriangles, 100000u);
    EXPECT_LT(counts.drawnTriangles, 300000u);
    EXPECT_LT(counts.uses.size(), 64u);
    RecordProperty("triangles", static_cast<int>(counts.drawnTriangles));
    std::printf("city: %zu triangles drawn, %zu stored, %zu drawn nodes, %zu geometries, %zu containers\n",
                counts.drawnTriangles, counts.storedTriangles, counts.drawnNodes, counts.uses.size(),
                aspect.containerCount());
}

TEST_F(DemoFigures, PalmsHaveAsManyTrianglesAsAreAskedFor) {
    for (const int wanted : {2000, 2602, 3027, 10000}) {
        ASSERT_NO_FATAL_FAILURE(build("demo:palms?triangles=" + std::to_string(wanted)));
        EXPECT_EQ(counts.drawnTriangles, static_cast<std::size_t>(wanted));
    }
    EXPECT_FALSE(buildDemo("demo:palms?triangles=100", aspect));
    EXPECT_FALSE(buildDemo("demo:city?triangles=2602", aspect));
}

TEST_F(DemoFigures, CarHasOneWheelGeometryOnFourNodes) {
    ASSERT_NO_FATAL_FAILURE(build("demo:car"));
    std::size_t wheels = 0;
    for (const auto& [id, uses] : counts.uses)
        if (aspect.findAs<Geometry>(id)->name.get() == "wheel") {
            ++wheels;
            EXPECT_EQ(uses, 4);
        }
    EXPECT_EQ(wheels, 1u);
    ASSERT_EQ(scene->animations.size(), 1u);
    EXPECT_EQ(aspect.get(scene->animations[0]).channels.size(), 5u);
}

TEST_F(DemoFigures, ClothIsFinelyTessellatedAndAboveTheFloorAndTheBall) {
    ASSERT_NO_FATAL_FAILURE(build("demo:cloth"));
    for (ContainerId id : aspect.ids()) {
        const auto* geometry = aspect.findAs<Geometry>(id);
        if (!geometry || geometry->name.get() != "cloth") continue;
        EXPECT_EQ(geometry->indices.size() / 3, 20000u);
        for (const glm::vec3& p : geometry->positions.toVector()) {
            ASSERT_GT(p.y, 0.0f);
            ASSERT_GT(glm::distance(p, glm::vec3(0.0f, 0.78f, 0.0f)), 0.46f);
        }
    }
}

TEST_F(DemoFigures, PalmsHaveThreeDistancesSharedShapesAndTheCamerasOfTheExperiments) {
    ASSERT_NO_FATAL_FAILURE(build("demo:palms"));
    EXPECT_LT(counts.storedTriangles, counts.drawnTriangles);
    EXPECT_EQ(scene->cameras.size(), 6u);
    const auto [eyeZ, bands] = std::pair(16.0, std::array{std::pair(0.0, 30.0), std::pair(30.0, 60.0), std::pair(60.0, 110.0)});
    std::array<int, 3> palms{};
    for (ContainerId id : aspect.ids()) {
        const auto* node = aspect.findAs<Node>(id);
        if (!node || !node->name->starts_with("palm ")) continue;
        const auto* place = aspect.findAs<Transform>(node->core.get().id);
        if (!place) continue;
        for (std::size_t i = 0; i < bands.size(); ++i)
            palms[i] += eyeZ - place->translation->z >= bands[i].first && eyeZ - place->translation->z < bands[i].second;
    }
    EXPECT_EQ(palms, (std::array{3, 3, 3}));
}

TEST_F(DemoFigures, UnknownDemosAndOptionsAreRefusedNamingTheKnownOnes) {
    const auto message = [&](const char* uri) {
        const auto result = buildDemo(uri, aspect);
        EXPECT_TRUE(result.has_error()) << uri;
        EXPECT_EQ(result.error().kind, Error::Kind::BadInput);
        return result.error().message;
    };
    for (const char* uri : {"demo:", "demo:forest", "demo:City", "city"})
        for (const DemoDescription& demo : demos())
            EXPECT_NE(message(uri).find(std::string("demo:") + std::string(demo.name)), std::string::npos) << uri;
    for (const char* uri : {"demo:city?m=3", "demo:city?n=0", "demo:city?n=", "demo:city?n=-4", "demo:city?n=1e3",
                            "demo:city?n", "demo:city?n=100001", "demo:city?n=99999999999999999999"})
        EXPECT_NE(message(uri).find("n=BUILDINGS (1 to 100000, default 2000)"), std::string::npos) << uri;
    EXPECT_NE(message("demo:car?n=3").find("none"), std::string::npos);
    EXPECT_EQ(aspect.containerCount(), 0u);
}

}  // namespace
}  // namespace umbriel
