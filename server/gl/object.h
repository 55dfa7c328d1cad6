#pragma once

#include <epoxy/gl.h>

#include <string_view>
#include <utility>

#include "common/base/result.h"

namespace umbriel::gl {

// Turns a pending driver error (out of memory, context lost, ...) into a result that says what was being done.
// Clears the error flag. Waits for the driver's front end: call it at creation and read-back, not per draw.
Result<void> checkError(std::string_view what);

// The context that is current on this thread; null when there is none.
const void* currentContext();

// Debug builds: ends the process unless `context` is current on this thread.
void assertCurrent(const void* context);

void deleteBuffer(GLuint id);
void deleteTexture(GLuint id);
void deleteRenderbuffer(GLuint id);
void deleteFramebuffer(GLuint id);
void deleteSampler(GLuint id);
void deleteVertexArray(GLuint id);
void deleteShader(GLuint id);
void deleteProgram(GLuint id);
void deleteQuery(GLuint id);

// Owns one GL name: move-only, deleted on destruction, empty when default-constructed. It must be destroyed on the
// thread where its context is current; debug builds assert it.
template <void (*Delete)(GLuint)>
class Name {
 public:
    Name() = default;
    explicit Name(GLuint id) : _id(id) {
#ifdef UMBRIEL_DEBUG
        _context = currentContext();
#endif
    }
    Name(Name&& other) noexcept {
        swap(other);
    }
    Name& operator=(Name&& other) noexcept {
        Name(std::move(other)).swap(*this);
        return *this;
    }
    Name(const Name&) = delete;
    Name& operator=(const Name&) = delete;
    ~Name() {
        if (!_id) return;
#ifdef UMBRIEL_DEBUG
        assertCurrent(_context);
#endif
        Delete(_id);
    }

    GLuint id() const {
        return _id;
    }
    explicit operator bool() const {
        return _id != 0;
    }

 private:
    void swap(Name& other) noexcept {
        std::swap(_id, other._id);
#ifdef UMBRIEL_DEBUG
        std::swap(_context, other._context);
#endif
    }

    GLuint _id = 0;
#ifdef UMBRIEL_DEBUG
    const void* _context = nullptr;
#endif
};

}  // namespace umbriel::gl
