#include "server/gl/readback.h"

#include <fmt/format.h>

#include "common/base/assert.h"

namespace umbriel::gl {
namespace {

Result<void> read(const Framebuffer& framebuffer, GLenum readBuffer, const PixelRect& rect, GLenum pixelFormat,
                  GLenum pixelType, std::span<std::byte> destination) {
    UMBRIEL_ASSERT(framebuffer.samples() <= 1, "read-back of a multisampled framebuffer; resolve it first");
    const glm::ivec2 end = rect.origin + rect.size;
    UMBRIEL_ASSERT(rect.origin.x >= 0 && rect.origin.y >= 0 && rect.size.x >= 0 && rect.size.y >= 0 &&
                       end.x <= framebuffer.size().x && end.y <= framebuffer.size().y,
                   "read-back outside the framebuffer");
    if (destination.empty()) return {};
    // glReadnPixels knows how much memory there is, but reads from the bound framebuffer only.
    GLint previous = 0;
    glGetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &previous);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer.id());
    if (readBuffer != GL_NONE) glNamedFramebufferReadBuffer(framebuffer.id(), readBuffer);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadnPixels(rect.origin.x, rect.origin.y, rect.size.x, rect.size.y, pixelFormat, pixelType,
                  static_cast<GLsizei>(destination.size()), destination.data());
    glBindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(previous));
    return checkError(fmt::format("reading back {}x{} pixels", rect.size.x, rect.size.y));
}

template <class Pixel>
Result<std::vector<Pixel>> readVector(const Framebuffer& framebuffer, GLenum readBuffer, const PixelRect& rect,
                                      GLenum pixelFormat, GLenum pixelType) {
    std::vector<Pixel> pixels(static_cast<size_t>(rect.size.x) * static_cast<size_t>(rect.size.y));
    auto done = read(framebuffer, readBuffer, rect, pixelFormat, pixelType, std::as_writable_bytes(std::span(pixels)));
    if (!done) return done.error();
    return pixels;
}

GLenum colourBuffer(int attachment) {
    return GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(attachment);
}

}  // namespace

Result<std::vector<glm::vec4>> readPixelsFloat(const Framebuffer& framebuffer, int attachment, const PixelRect& rect) {
    return readVector<glm::vec4>(framebuffer, colourBuffer(attachment), rect, GL_RGBA, GL_FLOAT);
}

Result<std::vector<glm::uvec4>> readPixelsUint(const Framebuffer& framebuffer, int attachment, const PixelRect& rect) {
    return readVector<glm::uvec4>(framebuffer, colourBuffer(attachment), rect, GL_RGBA_INTEGER, GL_UNSIGNED_INT);
}

Result<std::vector<float>> readPixelsDepth(const Framebuffer& framebuffer, const PixelRect& rect) {
    return readVector<float>(framebuffer, GL_NONE, rect, GL_DEPTH_COMPONENT, GL_FLOAT);
}

Result<void> readPixels(const Framebuffer& framebuffer, int attachment, const PixelRect& rect, GLenum pixelFormat,
                        GLenum pixelType, std::span<std::byte> destination) {
    return read(framebuffer, colourBuffer(attachment), rect, pixelFormat, pixelType, destination);
}

}  // namespace umbriel::gl
