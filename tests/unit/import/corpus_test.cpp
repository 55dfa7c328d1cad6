#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "client/import/load_scene.h"
#include "common/scene/core_types.h"

// Files of other people's collections, where they are at hand (UMBRIEL_SHARED): real scenes, and broken ones.

namespace umbriel {
namespace {

namespace fs = std::filesystem;

class Corpus : public testing::Test {
   protected:
    void SetUp() override {
        const char* shared = std::getenv("UMBRIEL_SHARED");
        if (!shared || !fs::exists(fs::path(shared) / "data")) GTEST_SKIP() << "UMBRIEL_SHARED is not set";
        _data = fs::path(shared) / "data";
        registerCoreTypes(_types);
    }

    fs::path _data;
    TypeRegistry _types;
};

// Triangles drawn: of every geometry once for each node that has it.
std::size_t trianglesBelow(const Aspect& scene, Ref<Node> root) {
    const Node& node = scene.get(root);
    std::size_t count = 0;
    if (const auto* geometry = scene.findAs<Geometry>(node.core.get())) count += geometry->indices.size() / 3;
    for (std::size_t i = 0; i < node.children.size(); ++i) count += trianglesBelow(scene, node.children[i]);
    return count;
}

TEST_F(Corpus, RealScenesHaveTheTrianglesOfTheirManifest) {
    const std::map<std::string, std::size_t> expected = {
        {"CesiumMilkTruck.glb", 3624},
        {"FlightHelmet.glb", 94722},
        {"2CylinderEngine.glb", 121496},
        {"MetalRoughSpheresNoTextures.glb", 1040409},
        {"Lantern.glb", 5394},
    };
    for (const auto& [name, triangles] : expected) {
        IdSource ids;
        Aspect scene(_types, ids);
        const auto start = std::chrono::steady_clock::now();
        const auto loaded = loadScene((_data / "gltf" / name).string(), scene, ids);
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        ASSERT_TRUE(loaded) << loaded.error().message;
        EXPECT_EQ(trianglesBelow(scene, scene.get(loaded->scene).root), triangles) << name;
        std::cout << name << ": " << seconds << " s, " << scene.containerCount() << " containers\n";
        for (const std::string& warning : loaded->warnings) std::cout << "  " << warning << "\n";
    }
}

}  // namespace
}  // namespace umbriel
