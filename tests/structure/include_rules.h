#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

// Who may include what (docs/architecture.md), as tables, and the check that reads source text against them.
namespace umbriel::structure {

// One #include line of a C++ or GLSL file.
struct Include {
    std::string path;
    bool quoted = false;  // "path" rather than <path>
    int line = 0;         // counted from 1
};

// Every #include line of the text that is not inside a comment.
std::vector<Include> includesIn(std::string_view text);

// The module a file belongs to: its first two folders ("common/base"), "shaders" for everything there, the first folder
// for what lies elsewhere ("tests").
std::string moduleOf(std::string_view path);

// True when the table has a row for the module.
bool isKnownModule(std::string_view module);

// True when the table allows files of one module to include files of the other. A module may always include itself;
// tests may include everything.
bool mayInclude(std::string_view from, std::string_view to);

// The arrows of the table that close a circle, as "a -> b"; empty when there is none.
std::vector<std::string> circlesInTable();

// What is wrong with the includes of a file, one readable line each; empty when nothing is. `path` is relative to the
// repository's root, `exists` answers for paths relative to it.
std::vector<std::string> wrongIncludes(const std::string& path, std::string_view text,
                                       const std::function<bool(const std::string&)>& exists);

// A module as CMake states it.
struct CMakeModule {
    std::string target;  // without the prefix umbriel_
    std::string module;  // "common/base"
    std::vector<std::string> dependencies;
};

// The umbriel_module(...) calls of a CMakeLists.txt that lies in `folder` ("common").
std::vector<CMakeModule> cmakeModulesIn(std::string_view text, const std::string& folder);

}  // namespace umbriel::structure
