#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "tests/structure/include_rules.h"
#include "tests/structure/repository.h"

namespace umbriel::structure {
namespace {

const std::set<std::string> kTopLevel{".ci",
                                      ".clang-format",
                                      ".editorconfig",
                                      ".gitignore",
                                      "CMakeLists.txt",
                                      "LICENSE",
                                      "README.md",
                                      "CONTRIBUTING.md",
                                      "CMakePresets.json",
                                      "SECURITY.md",
                                      "client",
                                      "common",
                                      "deploy",
                                      "docs",
                                      "server",
                                      "shaders",
                                      "tests"};

// Built by other means: the fuzz preset, and benchmarks.
bool isBuiltApart(const std::string& file) {
    return file.starts_with("tests/fuzz/") || file.starts_with("tests/bench/");
}

TEST(Tree, TopLevelHoldsOnlyWhatItMay) {
    const auto files = gitFiles();
    if (!files) {
        GTEST_SKIP() << "no git checkout";
    }
    for (const std::string& file : *files) {
        EXPECT_TRUE(kTopLevel.contains(file.substr(0, file.find('/')))) << file;
    }
}

TEST(Tree, EveryTrackedSourceIsReadByTheIncludeTest) {
    const auto files = gitFiles();
    if (!files) {
        GTEST_SKIP() << "no git checkout";
    }
    const std::vector<std::string> read = codeFiles();
    for (const std::string& file : *files) {
        const bool code = std::ranges::any_of(std::vector<std::string>{".h", ".hpp", ".cpp", ".cc", ".c", ".inc",
                                                                       ".glsl", ".vert", ".frag", ".geom", ".comp"},
                                              [&](const std::string& extension) { return file.ends_with(extension); });
        EXPECT_TRUE(!code || std::ranges::binary_search(read, file))
            << file << ": code lies below common, client, server, shaders or tests and ends in .h, .cpp, .inc or .glsl";
    }
}

// A source file that no target compiles, above all a test, would rot unseen.
TEST(Tree, EverySourceIsCompiled) {
    const std::string commands = readText(buildFolder() / "compile_commands.json");
    ASSERT_FALSE(commands.empty()) << "compile_commands.json is missing from " << buildFolder();
    for (const std::string& file : codeFiles()) {
        if (!file.ends_with(".cpp") || isBuiltApart(file)) {
            continue;
        }
        EXPECT_NE(commands.find("\"" + (sourceFolder() / file).string() + "\""), std::string::npos)
            << file << " is in no target; see umbriel_module and umbriel_test in the folder's CMakeLists.txt";
    }
}

}  // namespace
}  // namespace umbriel::structure
