#include "server/gl/framebuffer.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/assert.h"

namespace umbriel::gl {
namespace {

const char* statusText(GLenum status) {
    switch (status) {
        case GL_FRAMEBUFFER_INCOMPLETE_ATTACHMENT:
            return "an image of it cannot be drawn to";
        case GL_FRAMEBUFFER_INCOMPLETE_MISSING_ATTACHMENT:
            return "it has no image";
        case GL_FRAMEBUFFER_INCOMPLETE_MULTISAMPLE:
            return "its images differ in sample count";
        case GL_FRAMEBUFFER_UNSUPPORTED:
            return "the driver does not support this combination of formats";
        default:
            return "it is incomplete";
    }
}

bool hasStencil(GLenum format) {
    return format == GL_DEPTH24_STENCIL8 || format == GL_DEPTH32F_STENCIL8;
}

void attach(GLuint framebuffer, GLenum point, const Attachment& attachment) {
    if (attachment.isRenderbuffer)
        glNamedFramebufferRenderbuffer(framebuffer, point, GL_RENDERBUFFER, attachment.id);
    else
        glNamedFramebufferTexture(framebuffer, point, attachment.id, attachment.level);
}

}  // namespace

Attachment::Attachment(const Texture2D& texture, int mipLevel)
    : id(texture.id()),
      level(mipLevel),
      format(texture.format()),
      size(glm::max(glm::ivec2(texture.size().x >> mipLevel, texture.size().y >> mipLevel), glm::ivec2(1))) {}

Attachment::Attachment(const Renderbuffer& renderbuffer)
    : id(renderbuffer.id()),
      isRenderbuffer(true),
      format(renderbuffer.format()),
      size(renderbuffer.size()),
      samples(renderbuffer.samples()) {}

Result<Framebuffer> Framebuffer::create(std::span<const Attachment> colours, std::optional<Attachment> depth) {
    UMBRIEL_ASSERT(!colours.empty() || depth, "a framebuffer needs an image");
    const Attachment& first = colours.empty() ? *depth : colours.front();
    const auto matches = [&](const Attachment& a) { return a.size == first.size; };
    UMBRIEL_ASSERT(std::ranges::all_of(colours, matches) && (!depth || matches(*depth)),
                   "the images of a framebuffer differ in size");
    Framebuffer result;
    GLuint id = 0;
    glCreateFramebuffers(1, &id);
    result._name = Name<deleteFramebuffer>(id);
    result._size = first.size;
    result._samples = first.samples;
    for (const Attachment& colour : colours) {
        const GLenum point = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(result._drawBuffers.size());
        attach(id, point, colour);
        result._drawBuffers.push_back(point);
    }
    if (depth) {
        attach(id, hasStencil(depth->format) ? GL_DEPTH_STENCIL_ATTACHMENT : GL_DEPTH_ATTACHMENT, *depth);
        result._hasDepth = true;
    }
    if (colours.empty()) {
        glNamedFramebufferDrawBuffer(id, GL_NONE);
        glNamedFramebufferReadBuffer(id, GL_NONE);
    } else {
        glNamedFramebufferDrawBuffers(id, result.colourCount(), result._drawBuffers.data());
    }
    const std::string what =
        fmt::format("a framebuffer of {}x{} with {} colour images", first.size.x, first.size.y, colours.size());
    if (auto checked = checkError(what); !checked) return checked.error();
    const GLenum status = glCheckNamedFramebufferStatus(id, GL_DRAW_FRAMEBUFFER);
    if (status != GL_FRAMEBUFFER_COMPLETE)
        return failure(fmt::format("OpenGL: {}: {} (0x{:x})", what, statusText(status), status));
    return result;
}

void Framebuffer::bind() const {
    glBindFramebuffer(GL_FRAMEBUFFER, id());
}

void Framebuffer::clearColour(int attachment, glm::vec4 value) {
    glClearNamedFramebufferfv(id(), GL_COLOR, attachment, glm::value_ptr(value));
}

void Framebuffer::clearColourUint(int attachment, glm::uvec4 value) {
    glClearNamedFramebufferuiv(id(), GL_COLOR, attachment, glm::value_ptr(value));
}

void Framebuffer::clearDepth(float value) {
    glClearNamedFramebufferfv(id(), GL_DEPTH, 0, &value);
}

}  // namespace umbriel::gl
