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
    explicit Composer(std::span<const shaders::ShaderFile> files) : _files(files) {}

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
            const size_t open = current.find('"');
            const size_t close = open == std::string_view::npos ? open : current.find('"', open + 1);
            if (close == std::string_view::npos)
                return failure(fmt::format("{}: an include is written #include \"folder/file.glsl\"", place));
            if (auto included = append(current.substr(open + 1, close - open - 1), place); !included) return included;
            startLine(line + 1);
        }
        return {};
    }

    std::string text;

 private:
    std::span<const shaders::ShaderFile> _files;
    std::vector<std::string_view> _seen;
};

}  // namespace

Result<std::string> composeShader(std::string_view stageFile, std::span<const ShaderDefine> defines) {
    return composeShader(shaders::embeddedFiles(), stageFile, defines);
}

Result<std::string> composeShader(std::span<const shaders::ShaderFile> files, std::string_view stageFile,
                                  std::span<const ShaderDefine> defines) {
    Composer composer(files);
    composer.text = "#version 450 core\n";
    for (const ShaderDefine& define : defines)
        composer.text += fmt::format("#define {} {}\n", define.name, define.value);
    if (auto appended = composer.append(stageFile, {}); !appended) return appended.error();
    return std::move(composer.text);
}

}  // namespace umbriel::gl
