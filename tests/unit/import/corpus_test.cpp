#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "client/import/load_scene.h"
#include "common/scene/core_types.h"
#include "tests/support/wait_until.h"

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
    const auto* deformed = scene.findAs<DeformedGeometry>(node.core.get());
    if (const auto* geometry = scene.findAs<Geometry>(deformed ? deformed->geometry.get().id : node.core.get().id))
        count += geometry->indices.size() / 3;
    for (std::size_t i = 0; i < node.children.size(); ++i) count += trianglesBelow(scene, node.children[i]);
    return count;
}

// Rows of the manifest's table of scenes: path and "tris drawn N".
std::map<std::string, std::size_t> trianglesOfManifest(const fs::path& data) {
    std::map<std::string, std::size_t> triangles;
    std::ifstream manifest(data / "MANIFEST.md");
    for (std::string line; std::getline(manifest, line);) {
        const std::size_t count = line.find("tris drawn ");
        if (!line.starts_with("| `gltf/") || count == std::string::npos) continue;
        triangles[line.substr(3, line.find('`', 3) - 3)] = std::stoul(line.substr(count + 11));
    }
    return triangles;
}

TEST_F(Corpus, RealScenesHaveTheTrianglesOfTheirManifest) {
    const auto expected = trianglesOfManifest(_data);
    EXPECT_GT(expected.size(), 20u);
    for (const auto& [name, triangles] : expected) {
        if (name.find("unsupported/") != std::string::npos) continue;
        IdSource ids;
        Aspect scene(_types, ids);
        const auto loaded = loadScene((_data / name).string(), scene, ids);
        ASSERT_TRUE(loaded) << loaded.error().message;
        EXPECT_EQ(trianglesBelow(scene, scene.get(loaded->scene).root), triangles) << name;
    }
}

TEST_F(Corpus, UnsupportedRequiredExtensionsAreNamed) {
    IdSource ids;
    Aspect scene(_types, ids);
    const auto loaded = loadScene((_data / "gltf/unsupported/Box_Draco.glb").string(), scene, ids);
    ASSERT_FALSE(loaded);
    EXPECT_NE(loaded.error().message.find("KHR_draco_mesh_compression"), std::string::npos) << loaded.error().message;
    EXPECT_EQ(loaded.error().kind, Error::Kind::BadInput);
    EXPECT_EQ(scene.containerCount(), 0u);
}

TEST_F(Corpus, MeshesLoad) {
    for (const char* folder : {"mesh", "cloth"})
        for (const auto& entry : fs::directory_iterator(_data / folder)) {
            if (entry.path().extension() != ".obj") continue;
            IdSource ids;
            Aspect scene(_types, ids);
            const auto loaded = loadScene(entry.path().string(), scene, ids);
            ASSERT_TRUE(loaded) << loaded.error().message;
            EXPECT_GT(trianglesBelow(scene, scene.get(loaded->scene).root), 0u) << entry.path();
        }
}

// Errors that the glTF validator counts, by file relative to data/.
std::map<std::string, int> expectedErrors(const fs::path& data) {
    std::map<std::string, int> errors;
    std::ifstream table(data / "bad/gltf-validator/expected.tsv");
    std::string line;
    std::getline(table, line);
    while (std::getline(table, line)) {
        std::istringstream row(line);
        std::string file;
        int count = 0;
        row >> file >> count;
        errors[file] = count;
    }
    return errors;
}

TEST_F(Corpus, BrokenFilesEndInTimeAndMemoryAndValidOnesLoad) {
    const auto errors = expectedErrors(_data);
    EXPECT_GT(errors.size(), 100u);
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(_data / "bad"))
        if (entry.is_regular_file()) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::size_t loadedCount = 0;
    std::size_t refusedCount = 0;
    ImportLimits limits;
    limits.cpuTime = std::chrono::seconds(10);  // whoever needs more is a failure, not bad input
    limits.wallTime = test::kPatience;
    for (const fs::path& file : files) {
        const std::string name = fs::relative(file, _data).string();
        IdSource ids;
        Aspect scene(_types, ids);
        const auto loaded = loadScene(file.string(), scene, ids, limits);
        const auto expected = errors.find(name);
        const int known = expected == errors.end() ? -1 : expected->second;
        if (loaded) {
            ++loadedCount;
            continue;
        }
        ++refusedCount;
        const std::string& reason = loaded.error().message;
        EXPECT_NE(known, 0) << reason;
        EXPECT_NE(reason.find(file.string()), std::string::npos) << "names the file: " << reason;
        EXPECT_EQ(reason.find('\n'), std::string::npos) << reason;
        EXPECT_EQ(scene.containerCount(), 0u) << "nothing half-loaded: " << reason;
        EXPECT_EQ(reason.find("crashed"), std::string::npos) << reason;
        EXPECT_EQ(loaded.error().kind, Error::Kind::BadInput) << reason;
    }
    rusage children{};
    getrusage(RUSAGE_CHILDREN, &children);
    EXPECT_LT(children.ru_maxrss, 2 * 1024 * 1024) << "KiB";
    std::cout << loadedCount << " loaded, " << refusedCount << " refused, largest import process "
              << children.ru_maxrss / 1024 << " MiB\n";
}

}  // namespace
}  // namespace umbriel
