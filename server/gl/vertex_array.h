#pragma once

#include <cstddef>

#include "server/gl/buffer.h"
#include "server/gl/object.h"

namespace umbriel::gl {

// One vertex attribute inside a vertex buffer.
struct VertexAttribute {
    GLuint location = 0;      // layout(location = ...) of the vertex shader
    GLuint binding = 0;       // which vertex buffer
    GLint components = 4;     // 1..4
    GLenum type = GL_FLOAT;   // of a component in memory
    bool normalized = false;  // integers in memory map to [0, 1] or [-1, 1]
    bool integer = false;     // integers in memory stay integers in the shader
    GLuint offset = 0;        // bytes from the start of a vertex
};

// Which buffers feed which attributes. Borrows the buffers: they must live as long as it is drawn with.
class VertexArray {
 public:
    // An empty handle.
    VertexArray() = default;
    static VertexArray create();

    void attribute(const VertexAttribute& attribute);
    // `divisor` 0: one element per vertex; 1: one per instance.
    void vertexBuffer(GLuint binding, const Buffer& buffer, size_t offset, size_t stride, GLuint divisor = 0);
    void elementBuffer(const Buffer& buffer);
    void bind() const;

    GLuint id() const { return _name.id(); }
    explicit operator bool() const { return static_cast<bool>(_name); }

 private:
    Name<deleteVertexArray> _name;
};

}  // namespace umbriel::gl
