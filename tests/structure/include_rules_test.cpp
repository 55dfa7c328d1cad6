#include "tests/structure/include_rules.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>

#include "tests/structure/repository.h"

namespace umbriel::structure {
namespace {

bool existsInRepository(const std::string& path) {
    return std::filesystem::is_regular_file(sourceFolder() / path);
}

// As if every file existed: for text that is not in the repository.
std::vector<std::string> wrongIn(const std::string& path, std::string_view text) {
    return wrongIncludes(path, text, [](const std::string&) { return true; });
}

std::string joined(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) {
        text += line + "\n";
    }
    return text;
}

// Every module CMake states, over the three folders that hold modules.
std::vector<CMakeModule> cmakeModules() {
    std::vector<CMakeModule> modules;
    for (const char* folder : {"common", "client", "server"}) {
        std::ranges::move(cmakeModulesIn(readText(sourceFolder() / folder / "CMakeLists.txt"), folder),
                          std::back_inserter(modules));
    }
    return modules;
}

TEST(Includes, FollowTheTable) {
    std::vector<std::string> wrong;
    for (const std::string& file : codeFiles()) {
        std::ranges::move(wrongIncludes(file, readText(sourceFolder() / file), existsInRepository),
                          std::back_inserter(wrong));
    }
    EXPECT_TRUE(wrong.empty()) << joined(wrong);
}

TEST(Includes, TableHasNoCircle) {
    EXPECT_EQ(joined(circlesInTable()), "");
}

TEST(Includes, ClientAndServerNeverKnowEachOther) {
    for (const char* client :
         {"client/import", "client/session", "client/bake", "client/trade", "client/app", "client/main"}) {
        for (const char* server : {"server/gl", "server/shadow", "server/light", "server/draw", "server/bake",
                                   "server/session", "server/app"}) {
            EXPECT_FALSE(mayInclude(client, server)) << client << " -> " << server;
            EXPECT_FALSE(mayInclude(server, client)) << server << " -> " << client;
        }
        EXPECT_FALSE(mayInclude(client, "shaders")) << client;
        EXPECT_FALSE(mayInclude("common/net", client)) << client;
    }
}

// The targets say the same as the folders: no module links what it may not include, nor includes what it does not link.
TEST(Includes, CMakeTargetsSayTheSame) {
    std::map<std::string, std::string> moduleOfTarget{{"shaders", "shaders"}};
    std::map<std::string, std::set<std::string>> linked;  // by module, with what its dependencies link
    for (const CMakeModule& module : cmakeModules()) {
        moduleOfTarget[module.target] = module.module;
        linked[module.module];
        for (const std::string& dependency : module.dependencies) {
            ASSERT_TRUE(moduleOfTarget.contains(dependency))
                << module.module << " before its dependency " << dependency;
            const std::string& to = moduleOfTarget[dependency];
            EXPECT_TRUE(mayInclude(module.module, to)) << "CMake: " << module.module << " may not link " << to;
            linked[module.module].insert(to);
            if (linked.contains(to)) {
                linked[module.module].insert(linked[to].begin(), linked[to].end());
            }
        }
    }
    for (const std::string& file : codeFiles()) {
        const std::string from = moduleOf(file);
        if (!linked.contains(from)) {
            continue;  // programs and tests are wired by hand
        }
        for (const Include& include : includesIn(readText(sourceFolder() / file))) {
            const std::string to = moduleOf(include.path);
            if (include.quoted && to != from && isKnownModule(to)) {
                EXPECT_TRUE(linked[from].contains(to)) << file << " includes " << to << ", which CMake does not link";
            }
        }
    }
}

// The check itself: a planted mistake is found, and named.
TEST(Includes, PlantedMistakesAreFound) {
    struct Planted {
        const char* path;
        const char* text;
        const char* complaint;
    };
    const Planted mistakes[] = {
        {"common/base/a.cpp", "#include \"common/math/b.h\"\n", "common/base may not include common/math"},
        {"common/scene/a.h", "\n\n#include \"common/wall/b.h\"\n", "common/scene/a.h:3: common/wall/b.h"},
        {"common/wire/a.h", "#include \"common/protocol/b.h\"\n", "may not include common/protocol"},
        {"common/net/a.cpp", "#include \"server/draw/b.h\"\n", "may not include server/draw"},
        {"client/session/a.cpp", "# include \"server/session/b.h\"\n", "may not include server/session"},
        {"client/app/a.cpp", "#include \"shaders/embedded.h\"\n", "may not include shaders"},
        {"client/import/a.cpp", "#include \"client/app/b.h\"\n", "may not include client/app"},
        {"server/gl/a.cpp", "#include \"server/shadow/b.h\"\n", "may not include server/shadow"},
        {"server/draw/a.cpp", "#include \"client/import/b.h\"\n", "may not include client/import"},
        {"server/draw/a.cpp", "#include \"tests/golden/b.h\"\n", "may not include tests"},
        {"server/draw/a.cpp", "#include <common/base/b.h>\n", "with quotes"},
        {"server/draw/a.cpp", "#include \"b.h\"\n", "no such file"},
        {"server/session/a.cpp", "#include <epoxy/gl.h>\n", "OpenGL only in"},
        {"client/app/render.cpp", "#include <GLFW/glfw3.h>\n", "OpenGL only in"},
        {"common/protocol/a.cpp", "#include <boost/asio.hpp>\n", "Asio only in"},
        {"common/net/pump.cpp", "#include <boost/asio/ip/tcp.hpp>\n", "Asio only in"},
        {"common/net/asio_pump.h", "#include <boost/asio.hpp>\n", "too expensive"},
        {"client/session/a.cpp", "#include <CLI/CLI.hpp>\n", "CLI11 only in"},
        {"client/app/a.cpp", "#include \"client/main/b.h\"\n", "may not include client/main"},
        {"common/scene/a.cpp", "#include <spdlog/spdlog.h>\n", "spdlog only in"},
        {"client/import/a.h", "#include <nlohmann/json.hpp>\n", "too expensive"},
        {"common/newcomer/a.cpp", "", "common/newcomer is no module"},
        {"client/stray.cpp", "", "client/stray.cpp is no module"},
        {"shaders/stage/a.glsl", "#include \"common/math/b.h\"\n", "shaders may not include common/math"},
        {"shaders/structs_cpp.h", "#include \"common/scene/b.h\"\n", "shaders may not include common/scene"},
    };
    for (const Planted& planted : mistakes) {
        const auto wrong = wrongIn(planted.path, planted.text);
        ASSERT_EQ(wrong.size(), 1u) << planted.path << ": " << planted.text << joined(wrong);
        EXPECT_NE(wrong.front().find(planted.complaint), std::string::npos) << wrong.front();
    }
}

TEST(Includes, WhatTheTableAllowsPasses) {
    EXPECT_EQ(joined(wrongIn("common/net/asio_pump.cpp", "#include <boost/asio.hpp>\n#include \"common/wire/a.h\"\n")),
              "");
    EXPECT_EQ(joined(wrongIn("client/app/window.cpp", "#include <epoxy/gl.h>\n#include <GLFW/glfw3.h>\n")), "");
    EXPECT_EQ(joined(wrongIn("server/app/main.cpp", "#include <CLI/CLI.hpp>\n#include \"server/session/a.h\"\n")), "");
    EXPECT_EQ(joined(wrongIn("shaders/stage/a.glsl", "#include \"formula/brdf.glsl\"\n")), "");
    EXPECT_EQ(joined(wrongIn("tests/golden/a.cpp", "#include <epoxy/gl.h>\n#include \"client/app/a.h\"\n")), "");
}

TEST(Includes, CommentsAreNotIncludes) {
    const auto found =
        includesIn("// #include \"a.h\"\n/* one\n#include \"b.h\"\n*/\n#include \"c.h\"  // why\n#include <d>\n");
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(found[0].path, "c.h");
    EXPECT_EQ(found[0].line, 5);
    EXPECT_TRUE(found[0].quoted);
    EXPECT_EQ(found[1].path, "d");
    EXPECT_FALSE(found[1].quoted);
}

}  // namespace
}  // namespace umbriel::structure
