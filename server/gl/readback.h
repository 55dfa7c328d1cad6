#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/math/glm.h"
#include "server/gl/framebuffer.h"

namespace umbriel::gl {

// Pixels from the lower left corner.
struct PixelRect {
    glm::ivec2 origin{0};
    glm::ivec2 size{0};
};

// All of these wait for the drawing to finish and return rows bottom first, tightly packed. The framebuffer must not
// be multisampled and the rectangle must lie inside it. Error: the driver ran out of memory or lost the context.

// Missing channels read 0, a missing alpha 1. Bits of a GL_RGBA32F image come back unchanged.
Result<std::vector<glm::vec4>> readPixelsFloat(const Framebuffer& framebuffer, int attachment, const PixelRect& rect);
// For unsigned integer images.
Result<std::vector<glm::uvec4>> readPixelsUint(const Framebuffer& framebuffer, int attachment, const PixelRect& rect);
// Depth as stored, in [0, 1].
Result<std::vector<float>> readPixelsDepth(const Framebuffer& framebuffer, const PixelRect& rect);
// Any format and type into memory of the caller, which must be exactly large enough for the driver to fill.
Result<void> readPixels(const Framebuffer& framebuffer, int attachment, const PixelRect& rect, GLenum pixelFormat,
                        GLenum pixelType, std::span<std::byte> destination);

}  // namespace umbriel::gl
