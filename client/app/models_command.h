#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>

#include "client/app/render_command.h"

namespace umbriel {

// The command line of `umbriel models`.
struct ModelsArguments {
    SceneArguments scene;  // size: of each picture
    std::string out;       // .png of all pictures; empty: none
    int frames = 7;        // drawn for the cost, the quickest counts
    bool json = false;
};

// umbriel models: one scene under every reflection model and shading frequency, with the error of each against double
// precision, its Mach bands and its cost. Exit code 0, 1 or 2 (docs/commands.md).
int runModels(const ModelsArguments& arguments, const std::filesystem::path& serverProgram, std::ostream& out);

}  // namespace umbriel
