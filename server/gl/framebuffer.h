#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/math/glm.h"
#include "server/gl/texture.h"

namespace umbriel::gl {

// What a framebuffer draws into. Borrows the image: it must outlive the framebuffer.
struct Attachment {
    Attachment(const Texture2D& texture, int level = 0);
    Attachment(const Renderbuffer& renderbuffer);

    GLuint id = 0;
    bool isRenderbuffer = false;
    int level = 0;
    GLenum format = 0;
    glm::ivec2 size{0};
    int samples = 0;
};

// Colour images by index and at most one depth (or depth-stencil) image. All have one size and sample count.
class Framebuffer {
 public:
    Framebuffer() = default;
    // Colour attachment i is fragment output location i. Errors: the driver does not support the combination.
    static Result<Framebuffer> create(std::span<const Attachment> colours, std::optional<Attachment> depth = {});

    // Target of drawing and clearing. Does not touch the viewport.
    void bind() const;

    // These write whole images and ignore bound state but the scissor, colour and depth masks.
    void clearColour(int attachment, glm::vec4 value);
    void clearColourUint(int attachment, glm::uvec4 value);
    void clearDepth(float value);

    glm::ivec2 size() const { return _size; }
    int samples() const { return _samples; }
    int colourCount() const { return static_cast<int>(_drawBuffers.size()); }
    bool hasDepth() const { return _hasDepth; }
    GLuint id() const { return _name.id(); }
    explicit operator bool() const { return static_cast<bool>(_name); }

 private:
    Name<deleteFramebuffer> _name;
    std::vector<GLenum> _drawBuffers;
    glm::ivec2 _size{0};
    int _samples = 0;
    bool _hasDepth = false;
};

}  // namespace umbriel::gl
