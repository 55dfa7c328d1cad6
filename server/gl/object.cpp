#include "server/gl/object.h"

#include <epoxy/egl.h>
#include <fmt/format.h>

#include "common/base/assert.h"

namespace umbriel::gl {
namespace {

const char* errorText(GLenum error) {
    switch (error) {
        case GL_OUT_OF_MEMORY:
            return "out of graphics memory";
        case GL_CONTEXT_LOST:
            return "the graphics driver was reset and lost the context";
        case GL_INVALID_ENUM:
            return "GL_INVALID_ENUM";
        case GL_INVALID_VALUE:
            return "GL_INVALID_VALUE";
        case GL_INVALID_OPERATION:
            return "GL_INVALID_OPERATION";
        case GL_INVALID_FRAMEBUFFER_OPERATION:
            return "GL_INVALID_FRAMEBUFFER_OPERATION";
        default:
            return "an unknown error";
    }
}

}  // namespace

Result<void> checkError(std::string_view what) {
    const GLenum first = glGetError();
    if (first == GL_NO_ERROR) return {};
    // Distributed implementations keep several flags; a lost context reports for ever, hence the bound.
    for (int i = 0; i < 16 && glGetError() != GL_NO_ERROR; ++i) {
    }
    return failure(fmt::format("OpenGL: {}: {}", what, errorText(first)));
}

const void* currentContext() {
    return eglGetCurrentContext();
}

void assertCurrent(const void* context) {
    UMBRIEL_ASSERT(context && eglGetCurrentContext() == context,
                   "a GL object was used on a thread where its context is not current");
}

void deleteBuffer(GLuint id) {
    glDeleteBuffers(1, &id);
}
void deleteTexture(GLuint id) {
    glDeleteTextures(1, &id);
}
void deleteRenderbuffer(GLuint id) {
    glDeleteRenderbuffers(1, &id);
}
void deleteFramebuffer(GLuint id) {
    glDeleteFramebuffers(1, &id);
}
void deleteSampler(GLuint id) {
    glDeleteSamplers(1, &id);
}
void deleteVertexArray(GLuint id) {
    glDeleteVertexArrays(1, &id);
}
void deleteShader(GLuint id) {
    glDeleteShader(id);
}
void deleteProgram(GLuint id) {
    glDeleteProgram(id);
}
void deleteQuery(GLuint id) {
    glDeleteQueries(1, &id);
}

}  // namespace umbriel::gl
