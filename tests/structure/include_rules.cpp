#include "tests/structure/include_rules.h"

#include <algorithm>
#include <array>
#include <regex>
#include <sstream>
#include <utility>

namespace umbriel::structure {
namespace {

// A module and what its files may include beside themselves. A folder that is not here may not hold code: a new module
// states its place first.
struct ModuleRule {
    std::string_view module;
    std::string_view mayInclude;  // separated by blanks; "common/*" stands for every module below common/
};

constexpr std::array kModules{
    // base <- math <- scene, wall, visibility, image, trace <- wire <- protocol <- net; a wall layout may know the
    // scene, and visibility maps are made with rays
    ModuleRule{"common/base", ""},
    ModuleRule{"common/math", "common/base"},
    ModuleRule{"common/scene", "common/base common/math"},
    ModuleRule{"common/wall", "common/base common/math common/scene"},
    ModuleRule{"common/light", "common/base common/math common/scene shaders"},  // the formulas, as C++
    ModuleRule{"common/visibility", "common/base common/math common/trace"},
    ModuleRule{"common/image", "common/base common/math"},
    ModuleRule{"common/trace", "common/base common/math"},
    ModuleRule{"common/wire",
               "common/base common/math common/scene common/wall common/visibility common/image common/trace"},
    ModuleRule{"common/protocol",
               "common/base common/math common/scene common/wall common/visibility common/image common/trace "
               "common/wire"},
    ModuleRule{"common/net",
               "common/base common/math common/scene common/wall common/visibility common/image common/trace "
               "common/wire common/protocol"},

    // import, session, bake, trade <- app <- main
    ModuleRule{"client/import", "common/*"},
    ModuleRule{"client/session", "common/*"},
    ModuleRule{"client/bake", "common/*"},
    ModuleRule{"client/trade", "common/*"},
    ModuleRule{"client/app", "common/* client/import client/session client/bake client/trade"},
    ModuleRule{"client/main", "common/* client/*"},

    // gl <- shadow, light <- draw <- session <- app, and bake beside drawing
    ModuleRule{"server/gl", "common/* shaders"},
    ModuleRule{"server/shadow", "common/* shaders server/gl"},
    ModuleRule{"server/light", "common/* shaders server/gl"},
    ModuleRule{"server/draw", "common/* shaders server/gl server/shadow server/light"},
    ModuleRule{"server/bake", "common/* shaders server/gl"},
    ModuleRule{"server/session", "common/* server/gl server/shadow server/light server/draw server/bake"},
    ModuleRule{"server/app", "common/* server/*"},

    ModuleRule{"shaders", ""},
};

// A library whose headers stay inside the listed paths (prefixes); empty: nowhere.
struct LibraryRule {
    std::string_view name;
    std::string_view headers;  // prefixes of the include, separated by blanks
    std::string_view allowedIn;
    std::string_view reason;
};

constexpr std::array kLibraries{
    LibraryRule{"OpenGL", "epoxy/ GL/ GLES2/ GLES3/ EGL/ KHR/ GLFW/",
                "server/gl/ server/draw/ server/shadow/ server/light/ server/bake/gl_ client/app/window",
                "everything else works, and is tested, without a context"},
    LibraryRule{"Asio", "boost/asio asio.hpp asio/", "common/net/asio_",
                "protocol code is a state machine fed with bytes and time"},
    LibraryRule{"CLI11", "CLI/", "client/main/ server/app/", "options belong to the programs"},
    LibraryRule{"spdlog", "spdlog/", "common/base/log.cpp", "common/base/log.h is the way to log"},
};

// Seconds of compiler time each (docs/dependencies.md): in .cpp files only.
constexpr std::string_view kExpensiveHeaders =
    "boost/asio asio.hpp CLI/ spdlog/ nlohmann/json.hpp tiny_gltf.h tiny_obj_loader.h";

std::vector<std::string_view> words(std::string_view text) {
    std::vector<std::string_view> result;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find(' '), text.size());
        if (end > 0) {
            result.push_back(text.substr(0, end));
        }
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return result;
}

bool startsWithAny(std::string_view text, std::string_view prefixes) {
    return std::ranges::any_of(words(prefixes), [&](std::string_view prefix) { return text.starts_with(prefix); });
}

bool isHeader(std::string_view path) {
    return path.ends_with(".h");
}

// Ours, whether written "..." or <...>.
bool isOurs(std::string_view include) {
    return startsWithAny(include, "common/ client/ server/ shaders/ tests/");
}

// GLSL files name each other relative to shaders/ as well, because the server composes them from there.
std::string resolve(const Include& include, std::string_view fromModule,
                    const std::function<bool(const std::string&)>& exists) {
    const std::string belowShaders = "shaders/" + include.path;
    return fromModule == "shaders" && !isOurs(include.path) && exists(belowShaders) ? belowShaders : include.path;
}

}  // namespace

std::vector<Include> includesIn(std::string_view text) {
    static const std::regex pattern(R"(^\s*#\s*include\s*(["<])([^">]+)[">].*)");
    std::vector<Include> result;
    std::istringstream stream{std::string(text)};
    std::string line;
    bool inComment = false;
    for (int number = 1; std::getline(stream, line); ++number) {
        std::smatch match;
        if (!inComment && std::regex_match(line, match, pattern)) {
            result.push_back({match[2], match[1] == "\"", number});
            continue;
        }
        const std::size_t open = line.rfind("/*");
        const std::size_t close = line.rfind("*/");
        if (close != std::string::npos && (open == std::string::npos || close > open)) {
            inComment = false;
        } else if (open != std::string::npos) {
            inComment = true;
        }
    }
    return result;
}

std::string moduleOf(std::string_view path) {
    const std::size_t first = path.find('/');
    const std::string_view top = path.substr(0, first);
    if (first == std::string_view::npos || (top != "common" && top != "client" && top != "server")) {
        return std::string(top);
    }
    return std::string(path.substr(0, path.find('/', first + 1)));
}

bool isKnownModule(std::string_view module) {
    return std::ranges::any_of(kModules, [&](const ModuleRule& rule) { return rule.module == module; });
}

bool mayInclude(std::string_view from, std::string_view to) {
    if (from == to || from == "tests") {
        return true;
    }
    const auto rule = std::ranges::find(kModules, from, &ModuleRule::module);
    return rule != kModules.end() && isKnownModule(to) &&
           std::ranges::any_of(words(rule->mayInclude), [&](std::string_view allowed) {
               return allowed.ends_with("/*") ? to.starts_with(allowed.substr(0, allowed.size() - 1)) : to == allowed;
           });
}

std::vector<std::string> circlesInTable() {
    // Peel off modules that include nothing any more; what stays is on a circle or leads to one.
    std::vector<std::string_view> left;
    for (const ModuleRule& rule : kModules) {
        left.push_back(rule.module);
    }
    const auto leans = [&left](std::string_view from) {
        return std::ranges::any_of(left, [&](std::string_view to) { return from != to && mayInclude(from, to); });
    };
    for (auto free = std::ranges::find_if_not(left, leans); free != left.end();
         free = std::ranges::find_if_not(left, leans)) {
        left.erase(free);
    }
    std::vector<std::string> arrows;
    for (std::string_view from : left) {
        for (std::string_view to : left) {
            if (from != to && mayInclude(from, to)) {
                arrows.push_back(std::string(from) + " -> " + std::string(to));
            }
        }
    }
    return arrows;
}

std::vector<std::string> wrongIncludes(const std::string& path, std::string_view text,
                                       const std::function<bool(const std::string&)>& exists) {
    const std::string from = moduleOf(path);
    std::vector<std::string> wrong;
    if (!isKnownModule(from) && from != "tests") {
        wrong.push_back(path + ": " + from + " is no module; give it a row in tests/structure/include_rules.cpp");
        return wrong;
    }
    for (const Include& include : includesIn(text)) {
        const auto complain = [&](const std::string& reason) {
            wrong.push_back(path + ":" + std::to_string(include.line) + ": " + include.path + ": " + reason);
        };
        if (include.quoted || isOurs(include.path)) {
            const std::string target = resolve(include, from, exists);
            const std::string to = moduleOf(target);
            if (!isOurs(target) || !exists(target)) {
                complain("no such file below the repository's root");
            } else if (!include.quoted) {
                complain("our own files are included with quotes");
            } else if (!mayInclude(from, to)) {
                complain(from + " may not include " + to);
            }
            continue;
        }
        if (from == "tests") {
            continue;
        }
        for (const LibraryRule& library : kLibraries) {
            if (startsWithAny(include.path, library.headers) && !startsWithAny(path, library.allowedIn)) {
                complain(std::string(library.name) + " only in " + std::string(library.allowedIn) + ": " +
                         std::string(library.reason));
            }
        }
        if (isHeader(path) && startsWithAny(include.path, kExpensiveHeaders)) {
            complain("too expensive for a header, include it in a .cpp");
        }
    }
    return wrong;
}

std::vector<CMakeModule> cmakeModulesIn(std::string_view text, const std::string& folder) {
    static const std::regex call(R"(umbriel_module\(([^)]*)\))");
    std::vector<CMakeModule> modules;
    const std::string whole(text);
    for (std::sregex_iterator it(whole.begin(), whole.end(), call), end; it != end; ++it) {
        std::istringstream arguments((*it)[1].str());
        CMakeModule module;
        std::string word;
        arguments >> module.target >> word;
        module.module = folder + "/" + word;
        bool inDependencies = false;
        while (arguments >> word) {
            if (word == "DEPS" || word == "LIBS") {
                inDependencies = word == "DEPS";
            } else if (inDependencies) {
                module.dependencies.push_back(word);
            }
        }
        modules.push_back(std::move(module));
    }
    return modules;
}

}  // namespace umbriel::structure
