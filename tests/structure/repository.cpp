#include "tests/structure/repository.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>

namespace umbriel::structure {
namespace {

bool isCode(const std::filesystem::path& path) {
    const std::string extension = path.extension();
    return extension == ".h" || extension == ".cpp" || extension == ".glsl" || extension == ".inc";
}

}  // namespace

std::filesystem::path sourceFolder() {
    return UMBRIEL_SOURCE_DIR;
}

std::filesystem::path buildFolder() {
    return UMBRIEL_BUILD_DIR;
}

std::string readText(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::optional<std::vector<std::string>> gitFiles() {
    // safe.directory: a checkout owned by somebody else (a container's volume) is still the one under test.
    const std::string command = "git -c safe.directory='*' -C '" + sourceFolder().string() +
                                "' ls-files -z --cached --others --exclude-standard 2>/dev/null";
    std::FILE* pipe = popen(command.c_str(), "r");
    if (pipe == nullptr) {
        return std::nullopt;
    }
    std::vector<std::string> files(1);
    for (int character = std::fgetc(pipe); character != EOF; character = std::fgetc(pipe)) {
        if (character == '\0') {
            files.emplace_back();
        } else {
            files.back().push_back(static_cast<char>(character));
        }
    }
    files.pop_back();
    if (pclose(pipe) != 0 || files.empty()) {
        return std::nullopt;
    }
    // Listed, yet deleted in the working tree.
    std::erase_if(files, [](const std::string& file) { return !std::filesystem::exists(sourceFolder() / file); });
    std::ranges::sort(files);
    return files;
}

std::vector<std::string> codeFiles() {
    std::vector<std::string> files;
    for (const char* top : {"common", "client", "server", "shaders", "tests"}) {
        for (const auto& entry : std::filesystem::recursive_directory_iterator(sourceFolder() / top)) {
            if (entry.is_regular_file() && isCode(entry.path())) {
                files.push_back(entry.path().lexically_relative(sourceFolder()).string());
            }
        }
    }
    std::ranges::sort(files);
    return files;
}

}  // namespace umbriel::structure
