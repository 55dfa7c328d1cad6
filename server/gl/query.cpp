#include "server/gl/query.h"

#include <algorithm>
#include <utility>

namespace umbriel::gl {

Query::Query(GLenum target) : _target(target) {
    GLuint id = 0;
    glCreateQueries(target, 1, &id);
    _name = Name<deleteQuery>(id);
}

void Query::begin() {
    glBeginQuery(_target, _name.id());
}

void Query::end() {
    glEndQuery(_target);
}

uint64_t Query::result() const {
    GLuint64 value = 0;
    glGetQueryObjectui64v(_name.id(), GL_QUERY_RESULT, &value);
    return value;
}

Fence Fence::insert() {
    Fence fence;
    fence._sync = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
#ifdef UMBRIEL_DEBUG
    fence._context = currentContext();
#endif
    return fence;
}

Fence::Fence(Fence&& other) noexcept {
    *this = std::move(other);
}

Fence& Fence::operator=(Fence&& other) noexcept {
    std::swap(_sync, other._sync);
#ifdef UMBRIEL_DEBUG
    std::swap(_context, other._context);
#endif
    return *this;
}

Fence::~Fence() {
    if (!_sync) return;
#ifdef UMBRIEL_DEBUG
    assertCurrent(_context);
#endif
    glDeleteSync(_sync);
}

Result<bool> Fence::wait(std::chrono::nanoseconds timeout) {
    if (!_sync) return true;
    const auto nanoseconds = static_cast<GLuint64>(std::max<int64_t>(timeout.count(), 0));
    switch (glClientWaitSync(_sync, GL_SYNC_FLUSH_COMMANDS_BIT, nanoseconds)) {
        case GL_ALREADY_SIGNALED:
        case GL_CONDITION_SATISFIED:
            return true;
        case GL_TIMEOUT_EXPIRED:
            return false;
        default:
            return failure("OpenGL: waiting for the GPU failed; the driver was reset or lost the context");
    }
}

}  // namespace umbriel::gl
