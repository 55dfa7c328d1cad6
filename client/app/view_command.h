#pragma once

#include <filesystem>

#include "client/app/render_command.h"

namespace umbriel {

// The command line of `umbriel view`.
struct ViewArguments {
    ViewArguments() { scene.policy = "degrade"; }

    SceneArguments scene;
    std::uint64_t frames = 0;  // 0: until the window is closed
};

// umbriel view: one window that shows the wall as the servers draw it; the user orbits, pans and moves in and out.
int runView(const ViewArguments& arguments, const std::filesystem::path& serverProgram);

}  // namespace umbriel
