#include "server/gl/shader_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace umbriel::gl {
namespace {

std::string_view trimLeft(std::string_view text) {
    const size_t first = text.find_first_not_of(" \t");
    return first == std::string_view::npos ? std::string_view() : text.substr(first);
}

class Composer {
 public:
    Composer(std::span<const shaders::ShaderFile> files, std::span<const ShaderDefine> defines)
        : _files(files), _defines(defines) {}

    // `includedFrom` is "file:line" for the message; empty for the stage itself.
    Result<void> append(std::string_view path, const std::string& includedFrom) {
        if (std::ranges::find(_seen, path) != _seen.end()) return {};
        const auto file = std::ranges::find(_files, path, &shaders::ShaderFile::path);
        if (file == _files.end())
            return failure(fmt::format("there is no shader file \"{}\"{}", path,
                                       includedFrom.empty() ? "" : ", included at " + includedFrom));
        _seen.push_back(file->path);
        const auto startLine = [&](int line) { text += fmt::format("{}{}:{}\n", kOriginMarker, path, line); };
        startLine(1);
        std::string_view rest = file->text;
        for (int line = 1; !rest.empty(); ++line) {
            const size_t end = rest.find('\n');
            const std::string_view current = rest.substr(0, end);
            rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
            if (!trimLeft(current).starts_with("#include")) {
                text.append(current).push_back('\n');
                continue;
            }
            const std::string place = fmt::format("{}:{}", path, line);
            const std::string_view included = includedPath(current);
            if (included.empty())
                return failure(fmt::format(
                    "{}: an include is written #include \"folder/file.glsl\", or #include NAME with a define "
                    "of that name and form",
                    place));
            if (auto appended = append(included, place); !appended) return appended;
            startLine(line + 1);
        }
        return {};
    }

    std::string text;

 private:
    // Between the quotes of an include, or of the define that it names; empty when there are none.
    std::string_view includedPath(std::string_view line) const {
        std::string_view rest = trimLeft(trimLeft(line).substr(std::string_view("#include").size()));
        const auto named = std::ranges::find_if(_defines, [&](const ShaderDefine& define) {
            return rest.substr(0, rest.find_last_not_of(" \t\r") + 1) == define.name;
        });
        if (named != _defines.end()) rest = named->value;
        const size_t open = rest.find('"');
        const size_t close = open == std::string_view::npos ? open : rest.find('"', open + 1);
        return close == std::string_view::npos ? std::string_view() : rest.substr(open + 1, close - open - 1);
    }

    std::span<const shaders::ShaderFile> _files;
    std::span<const ShaderDefine> _defines;
    std::vector<std::string_view> _seen;
};

}  // namespace

Result<std::string> composeShader(std::string_view stageFile, std::span<const ShaderDefine> defines) {
    return composeShader(shaders::embeddedFiles(), stageFile, defines);
}

Result<std::string> composeShader(std::span<const shaders::ShaderFile> files, std::string_view stageFile,
                                  std::span<const ShaderDefine> defines) {
    Composer composer(files, defines);
    composer.text = "#version 450 core\n";
    for (const ShaderDefine& define : defines)
        // Paths are for the composer: GLSL has no strings.
        if (!define.value.starts_with('"')) composer.text += fmt::format("#define {} {}\n", define.name, define.value);
    if (auto appended = composer.append(stageFile, {}); !appended) return appended.error();
    return std::move(composer.text);
}

}  // namespace umbriel::gl
