#pragma once

#include <string>

namespace umbriel {

// By suffix, in either case.
bool isGltfFile(const std::string& file);  // .gltf, .glb
bool isObjFile(const std::string& file);   // .obj
bool isPlyFile(const std::string& file);   // .ply

}  // namespace umbriel
