#pragma once

#include <iterator>
#include <span>
#include <string_view>

namespace umbriel::shaders {

// A shader source file, embedded at build time: servers need no files at run time, and no shader text ever
// travels over the network (docs/protocol.md).
struct ShaderFile {
    std::string_view path;  // relative to shaders/, for example "formula/brdf.glsl"
    std::string_view text;
};

// All files under shaders/ that end in .glsl, in no particular order.
std::span<const ShaderFile> embeddedFiles();

}  // namespace umbriel::shaders
