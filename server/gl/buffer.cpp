#include "server/gl/buffer.h"

#include <fmt/format.h>

#include "common/base/assert.h"

namespace umbriel::gl {

Result<Buffer> Buffer::createFrom(size_t bytes, const void* content, GLbitfield flags) {
    Buffer buffer;
    GLuint id = 0;
    glCreateBuffers(1, &id);
    buffer._name = Name<deleteBuffer>(id);
    buffer._size = bytes;
    // GL has no empty buffers; one byte stands in, and size() still says 0.
    glNamedBufferStorage(id, static_cast<GLsizeiptr>(bytes ? bytes : 1), bytes ? content : nullptr, flags);
    if (auto checked = checkError(fmt::format("a buffer of {} bytes", bytes)); !checked) return checked.error();
    return buffer;
}

Result<Buffer> Buffer::create(size_t bytes, GLbitfield flags) {
    return createFrom(bytes, nullptr, flags);
}

Result<Buffer> Buffer::create(std::span<const std::byte> content, GLbitfield flags) {
    return createFrom(content.size(), content.data(), flags);
}

void Buffer::write(size_t offset, std::span<const std::byte> content) {
    UMBRIEL_ASSERT(offset <= _size && content.size() <= _size - offset, "write beyond the end of a buffer");
    if (content.empty()) return;
    glNamedBufferSubData(id(), static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(content.size()), content.data());
}

void Buffer::read(size_t offset, std::span<std::byte> destination) const {
    UMBRIEL_ASSERT(offset <= _size && destination.size() <= _size - offset, "read beyond the end of a buffer");
    if (destination.empty()) return;
    glGetNamedBufferSubData(id(), static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(destination.size()),
                            destination.data());
}

void Buffer::bindBase(GLenum target, GLuint index) const {
    glBindBufferBase(target, index, id());
}

void Buffer::bindRange(GLenum target, GLuint index, size_t offset, size_t bytes) const {
    UMBRIEL_ASSERT(offset <= _size && bytes <= _size - offset, "binding beyond the end of a buffer");
    glBindBufferRange(target, index, id(), static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes));
}

}  // namespace umbriel::gl
