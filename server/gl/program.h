#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/math/glm.h"
#include "server/gl/object.h"

namespace umbriel::gl {

// The complete text of one stage, as composeShader() returns it (shader_source.h).
struct ShaderStage {
    GLenum stage = GL_VERTEX_SHADER;
    std::string name;  // for messages, for example "stage/mesh.vert.glsl"
    std::string source;
};

// The driver's messages, each place followed by the numbered source lines around it, under the names and numbers of the
// files that `source` was composed of (kOriginMarker).
std::string explainShaderLog(std::string_view name, std::string_view source, std::string_view log);

// A linked program.
class Program {
 public:
    Program() = default;
    // Errors: a stage does not compile or the stages do not fit; the message quotes the source around the place.
    static Result<Program> link(std::span<const ShaderStage> stages);

    void use() const;

    // -1 when there is no such active uniform; setting -1 does nothing.
    GLint location(const char* uniform) const;
    void set(GLint location, int value) const;
    void set(GLint location, unsigned value) const;
    void set(GLint location, float value) const;
    void set(GLint location, const glm::ivec2& value) const;
    void set(GLint location, const glm::vec2& value) const;
    void set(GLint location, const glm::vec3& value) const;
    void set(GLint location, const glm::vec4& value) const;
    void set(GLint location, const glm::uvec4& value) const;
    void set(GLint location, const glm::mat3& value) const;
    void set(GLint location, const glm::mat4& value) const;

    GLuint id() const { return _name.id(); }
    explicit operator bool() const { return static_cast<bool>(_name); }

 private:
    Name<deleteProgram> _name;
};

}  // namespace umbriel::gl
