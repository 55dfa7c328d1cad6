#pragma once

#include <cstddef>
#include <span>

#include "server/gl/object.h"

namespace umbriel::gl {

// A buffer with immutable storage. Sizes and offsets are bytes.
class Buffer {
 public:
    // An empty handle; assign a created buffer before use.
    Buffer() = default;
    // Uninitialised storage. `flags` as in glNamedBufferStorage. Error: out of memory.
    static Result<Buffer> create(size_t bytes, GLbitfield flags = GL_DYNAMIC_STORAGE_BIT);
    // Storage filled with `content`; written again only when flags has GL_DYNAMIC_STORAGE_BIT. Error: out of memory.
    static Result<Buffer> create(std::span<const std::byte> content, GLbitfield flags = 0);

    // Overwrites [offset, offset + content.size()), which must lie inside.
    void write(size_t offset, std::span<const std::byte> content);
    // Reads back [offset, offset + destination.size()). After shader writes call glMemoryBarrier first
    // (GL_BUFFER_UPDATE_BARRIER_BIT), or stale bytes come back.
    void read(size_t offset, std::span<std::byte> destination) const;

    // Binds the whole buffer or a part to an indexed target: GL_UNIFORM_BUFFER, GL_SHADER_STORAGE_BUFFER, ...
    void bindBase(GLenum target, GLuint index) const;
    void bindRange(GLenum target, GLuint index, size_t offset, size_t bytes) const;

    size_t size() const { return _size; }
    GLuint id() const { return _name.id(); }
    explicit operator bool() const { return static_cast<bool>(_name); }

 private:
    static Result<Buffer> createFrom(size_t bytes, const void* content, GLbitfield flags);

    Name<deleteBuffer> _name;
    size_t _size = 0;
};

}  // namespace umbriel::gl
