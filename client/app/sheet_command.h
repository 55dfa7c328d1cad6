#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/app/render_command.h"

namespace umbriel {

// The command line of `umbriel sheet`.
struct SheetArguments {
    SheetArguments() { scene.size = "240x150"; }

    SceneArguments scene;           // size: of each picture
    std::vector<std::string> also;  // further scenes, with the same arguments
    std::string techniques;         // "std,light-map:pcf"; empty: every mode
    std::string out;                // .png
    int columns = 5;
    int levels = 256;  // of each colour channel: fewer make a smaller file
};

// umbriel sheet: scenes under every shadow mode that this version draws, or the techniques that are asked for, with
// their names, on one picture. Exit code 0, 1 or 2 (docs/commands.md).
int runSheet(const SheetArguments& arguments, const std::filesystem::path& serverProgram);

}  // namespace umbriel
