#include "client/import/scene_suffix.h"

#include <string_view>

namespace umbriel {
namespace {

bool endsWith(const std::string& file, std::string_view suffix) {
    if (file.size() < suffix.size()) return false;
    for (std::size_t i = 0; i < suffix.size(); ++i) {
        const char c = file[file.size() - suffix.size() + i];
        if ((c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c) != suffix[i]) return false;
    }
    return true;
}

}  // namespace

bool isGltfFile(const std::string& file) {
    return endsWith(file, ".gltf") || endsWith(file, ".glb");
}
bool isObjFile(const std::string& file) {
    return endsWith(file, ".obj");
}
bool isPlyFile(const std::string& file) {
    return endsWith(file, ".ply");
}

}  // namespace umbriel
