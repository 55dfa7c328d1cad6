#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "shaders/embedded.h"

namespace umbriel::gl {

// One feature switch of a shader: `#define name value`.
struct ShaderDefine {
    std::string name;
    std::string value = "1";
};

// Starts a comment line "//@ file:number" that says where the next line of a composed text came from. Not `#line`:
// Mesa 22.3 reports some errors of source string 1 as string 0, which would quote the wrong file.
inline constexpr std::string_view kOriginMarker = "//@ ";

// The complete text of a stage: `#version 450 core`, the defines in the given order, then the file with every
// `#include "path"` (relative to shaders/) replaced by that file, each file once, with
// origin markers that let Program::link quote the right place. `#include NAME` takes the path that the define NAME has
// as its value, quotes included: so a stage is composed with one of several files; such a define is not written. Same
// input, same text.
//
// Errors: no such file, an include that does not exist (our own bug, yet a message is kinder than an abort).
Result<std::string> composeShader(std::string_view stageFile, std::span<const ShaderDefine> defines = {});

// The same over a given set of files.
Result<std::string> composeShader(std::span<const shaders::ShaderFile> files, std::string_view stageFile,
                                  std::span<const ShaderDefine> defines = {});

}  // namespace umbriel::gl
