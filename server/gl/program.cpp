#include "server/gl/program.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <vector>

#include "server/gl/shader_source.h"

namespace umbriel::gl {
namespace {

// A line of the composed text and where it came from.
struct SourceLine {
    std::string_view file;
    int line = 0;
    std::string_view text;
};

bool takeNumber(std::string_view& text, int& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{}) return false;
    text.remove_prefix(static_cast<size_t>(end - text.data()));
    return true;
}

bool take(std::string_view& text, std::string_view expected) {
    if (!text.starts_with(expected)) return false;
    text.remove_prefix(expected.size());
    return true;
}

std::vector<std::string_view> splitLines(std::string_view text) {
    std::vector<std::string_view> lines;
    while (!text.empty()) {
        const size_t end = text.find('\n');
        lines.push_back(text.substr(0, end));
        if (end == std::string_view::npos) break;
        text.remove_prefix(end + 1);
    }
    return lines;
}

std::vector<SourceLine> originOfLines(std::string_view name, std::string_view source) {
    std::vector<SourceLine> lines;
    std::string_view file = name;
    int next = 1;
    for (const std::string_view text : splitLines(source)) {
        lines.push_back({file, next++, text});
        std::string_view rest = text;
        if (!take(rest, kOriginMarker)) continue;
        const size_t colon = rest.rfind(':');
        if (colon == std::string_view::npos) continue;
        file = rest.substr(0, colon);
        rest.remove_prefix(colon + 1);
        takeNumber(rest, next);
    }
    return lines;
}

// The line that a message is about. Mesa and Intel write "0:12(5): error", NVIDIA "0(12) : error", glslang and others
// "ERROR: 0:12: ".
std::optional<int> lineIn(std::string_view message) {
    const size_t digit = message.find_first_of("0123456789");
    if (digit == std::string_view::npos) return std::nullopt;
    message.remove_prefix(digit);
    int string = 0;
    int line = 0;
    if (takeNumber(message, string) && (take(message, ":") || take(message, "(")) && takeNumber(message, line) &&
        (message.starts_with("(") || message.starts_with(")") || message.starts_with(":")))
        return line;
    return std::nullopt;
}

const char* stageName(GLenum stage) {
    switch (stage) {
        case GL_VERTEX_SHADER:
            return "vertex";
        case GL_FRAGMENT_SHADER:
            return "fragment";
        case GL_GEOMETRY_SHADER:
            return "geometry";
        case GL_COMPUTE_SHADER:
            return "compute";
        case GL_TESS_CONTROL_SHADER:
            return "tessellation control";
        default:
            return "tessellation evaluation";
    }
}

std::string infoLog(GLuint id, void (*getParameter)(GLuint, GLenum, GLint*),
                    void (*getLog)(GLuint, GLsizei, GLsizei*, GLchar*)) {
    GLint length = 0;
    getParameter(id, GL_INFO_LOG_LENGTH, &length);
    std::string text(static_cast<size_t>(length > 0 ? length : 0), '\0');
    GLsizei written = 0;
    if (length > 0) getLog(id, length, &written, text.data());
    text.resize(static_cast<size_t>(written));
    return text;
}

}  // namespace

std::string explainShaderLog(std::string_view name, std::string_view source, std::string_view log) {
    constexpr size_t kContextLines = 2;
    constexpr int kQuotedPlaces = 5;  // one mistake often raises dozens of messages
    const std::vector<SourceLine> lines = originOfLines(name, source);
    std::string text;
    int quoted = 0;
    std::optional<int> previous;
    for (const std::string_view message : splitLines(log)) {
        if (message.empty()) continue;
        text += fmt::format("  {}\n", message);
        const auto line = lineIn(message);
        if (!line || line == previous || quoted == kQuotedPlaces) continue;
        if (*line < 1 || static_cast<size_t>(*line) > lines.size()) continue;
        previous = line;
        ++quoted;
        const size_t at = static_cast<size_t>(*line) - 1;
        for (size_t k = at > kContextLines ? at - kContextLines : 0; k < lines.size() && k <= at + kContextLines; ++k)
            text += fmt::format("  {} {}:{}: {}\n", k == at ? '>' : ' ', lines[k].file, lines[k].line, lines[k].text);
    }
    return text;
}

Result<Program> Program::link(std::span<const ShaderStage> stages) {
    Program program;
    program._name = Name<deleteProgram>(glCreateProgram());
    std::vector<Name<deleteShader>> shaders;
    for (const ShaderStage& stage : stages) {
        const GLuint shader = glCreateShader(stage.stage);
        shaders.emplace_back(shader);
        const GLchar* text = stage.source.data();
        const GLint length = static_cast<GLint>(stage.source.size());
        glShaderSource(shader, 1, &text, &length);
        glCompileShader(shader);
        GLint compiled = GL_FALSE;
        glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
        if (!compiled) {
            const auto getParameter = [](GLuint id, GLenum name, GLint* value) { glGetShaderiv(id, name, value); };
            const auto getLog = [](GLuint id, GLsizei size, GLsizei* written, GLchar* out) {
                glGetShaderInfoLog(id, size, written, out);
            };
            return failure(
                fmt::format("the {} shader \"{}\" does not compile:\n{}", stageName(stage.stage), stage.name,
                            explainShaderLog(stage.name, stage.source, infoLog(shader, getParameter, getLog))));
        }
        glAttachShader(program.id(), shader);
    }
    glLinkProgram(program.id());
    GLint linked = GL_FALSE;
    glGetProgramiv(program.id(), GL_LINK_STATUS, &linked);
    for (const auto& shader : shaders) glDetachShader(program.id(), shader.id());
    if (!linked) {
        const auto getParameter = [](GLuint id, GLenum name, GLint* value) { glGetProgramiv(id, name, value); };
        const auto getLog = [](GLuint id, GLsizei size, GLsizei* written, GLchar* out) {
            glGetProgramInfoLog(id, size, written, out);
        };
        std::string names;
        for (const ShaderStage& stage : stages) names += fmt::format(" \"{}\"", stage.name);
        return failure(
            fmt::format("the shaders{} do not link:\n{}", names, infoLog(program.id(), getParameter, getLog)));
    }
    return program;
}

void Program::use() const {
    glUseProgram(id());
}

GLint Program::location(const char* uniform) const {
    return glGetUniformLocation(id(), uniform);
}

void Program::set(GLint location, int value) const {
    glProgramUniform1i(id(), location, value);
}
void Program::set(GLint location, unsigned value) const {
    glProgramUniform1ui(id(), location, value);
}
void Program::set(GLint location, float value) const {
    glProgramUniform1f(id(), location, value);
}
void Program::set(GLint location, const glm::ivec2& value) const {
    glProgramUniform2iv(id(), location, 1, glm::value_ptr(value));
}
void Program::set(GLint location, const glm::vec2& value) const {
    glProgramUniform2fv(id(), location, 1, glm::value_ptr(value));
}
void Program::set(GLint location, const glm::vec3& value) const {
    glProgramUniform3fv(id(), location, 1, glm::value_ptr(value));
}
void Program::set(GLint location, const glm::vec4& value) const {
    glProgramUniform4fv(id(), location, 1, glm::value_ptr(value));
}
void Program::set(GLint location, const glm::uvec4& value) const {
    glProgramUniform4uiv(id(), location, 1, glm::value_ptr(value));
}
void Program::set(GLint location, const glm::mat3& value) const {
    glProgramUniformMatrix3fv(id(), location, 1, GL_FALSE, glm::value_ptr(value));
}
void Program::set(GLint location, const glm::mat4& value) const {
    glProgramUniformMatrix4fv(id(), location, 1, GL_FALSE, glm::value_ptr(value));
}

}  // namespace umbriel::gl
