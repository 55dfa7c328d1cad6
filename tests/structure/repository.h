#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

// The checked-out tree these tests were built from.
namespace umbriel::structure {

std::filesystem::path sourceFolder();
std::filesystem::path buildFolder();

// The file's bytes; empty when it cannot be read.
std::string readText(const std::filesystem::path& path);

// Every file git tracks or would add, relative to the root and sorted; nothing when this is no git checkout.
std::optional<std::vector<std::string>> gitFiles();

// Every C++ and GLSL file below common/, client/, server/, shaders/ and tests/, relative to the root and sorted.
std::vector<std::string> codeFiles();

}  // namespace umbriel::structure
