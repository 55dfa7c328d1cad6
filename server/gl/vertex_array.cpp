#include "server/gl/vertex_array.h"

namespace umbriel::gl {

VertexArray VertexArray::create() {
    GLuint id = 0;
    glCreateVertexArrays(1, &id);
    VertexArray array;
    array._name = Name<deleteVertexArray>(id);
    return array;
}

void VertexArray::attribute(const VertexAttribute& a) {
    glEnableVertexArrayAttrib(id(), a.location);
    if (a.integer)
        glVertexArrayAttribIFormat(id(), a.location, a.components, a.type, a.offset);
    else
        glVertexArrayAttribFormat(id(), a.location, a.components, a.type, a.normalized ? GL_TRUE : GL_FALSE, a.offset);
    glVertexArrayAttribBinding(id(), a.location, a.binding);
}

void VertexArray::vertexBuffer(GLuint binding, const Buffer& buffer, size_t offset, size_t stride, GLuint divisor) {
    glVertexArrayVertexBuffer(id(), binding, buffer.id(), static_cast<GLintptr>(offset), static_cast<GLsizei>(stride));
    glVertexArrayBindingDivisor(id(), binding, divisor);
}

void VertexArray::elementBuffer(const Buffer& buffer) {
    glVertexArrayElementBuffer(id(), buffer.id());
}

void VertexArray::bind() const {
    glBindVertexArray(id());
}

}  // namespace umbriel::gl
