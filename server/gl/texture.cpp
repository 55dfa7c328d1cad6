#include "server/gl/texture.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/assert.h"

namespace umbriel::gl {
namespace {

// 0 where we do not know the format or type: then the caller's size is not checked.
size_t bytesPerPixel(GLenum pixelFormat, GLenum pixelType) {
    size_t components = 0;
    switch (pixelFormat) {
        case GL_RED:
        case GL_RED_INTEGER:
        case GL_DEPTH_COMPONENT:
            components = 1;
            break;
        case GL_RG:
        case GL_RG_INTEGER:
            components = 2;
            break;
        case GL_RGB:
        case GL_RGB_INTEGER:
            components = 3;
            break;
        case GL_RGBA:
        case GL_BGRA:
        case GL_RGBA_INTEGER:
            components = 4;
            break;
        default:
            return 0;
    }
    switch (pixelType) {
        case GL_UNSIGNED_BYTE:
        case GL_BYTE:
            return components;
        case GL_UNSIGNED_SHORT:
        case GL_SHORT:
        case GL_HALF_FLOAT:
            return components * 2;
        case GL_UNSIGNED_INT:
        case GL_INT:
        case GL_FLOAT:
            return components * 4;
        default:
            return 0;
    }
}

std::string describe(const char* kind, GLenum format, glm::ivec2 size, int samples) {
    return fmt::format("a {} of {}x{}, format 0x{:x}, {} samples", kind, size.x, size.y, format, std::max(samples, 1));
}

}  // namespace

int fullMipLevels(glm::ivec2 size) {
    int levels = 1;
    for (int largest = std::max(size.x, size.y); largest > 1; largest /= 2) ++levels;
    return levels;
}

Result<Texture2D> Texture2D::create(GLenum format, glm::ivec2 size, int levels) {
    GLuint id = 0;
    glCreateTextures(GL_TEXTURE_2D, 1, &id);
    Texture2D texture(id, format, size);
    texture._levels = levels;
    glTextureStorage2D(id, levels, format, size.x, size.y);
    if (auto checked = checkError(describe("texture", format, size, 1)); !checked) return checked.error();
    return texture;
}

void Texture2D::upload(int level, GLenum pixelFormat, GLenum pixelType, std::span<const std::byte> content) {
    UMBRIEL_ASSERT(level >= 0 && level < _levels, "upload to a mip level that does not exist");
    const glm::ivec2 whole = this->size();
    const glm::ivec2 size = glm::max(glm::ivec2(whole.x >> level, whole.y >> level), glm::ivec2(1));
    const size_t pixel = bytesPerPixel(pixelFormat, pixelType);
    UMBRIEL_ASSERT(pixel == 0 || content.size() == pixel * static_cast<size_t>(size.x) * static_cast<size_t>(size.y),
                   "the pixels given do not fill the mip level");
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTextureSubImage2D(id(), level, 0, 0, size.x, size.y, pixelFormat, pixelType, content.data());
}

void Texture2D::generateMipmaps() {
    glGenerateTextureMipmap(id());
}

void Texture2D::bind(GLuint unit) const {
    glBindTextureUnit(unit, id());
}

Result<Renderbuffer> Renderbuffer::create(GLenum format, glm::ivec2 size, int samples) {
    GLuint id = 0;
    glCreateRenderbuffers(1, &id);
    Renderbuffer buffer(id, format, size);
    buffer._samples = samples;
    glNamedRenderbufferStorageMultisample(id, samples, format, size.x, size.y);
    if (auto checked = checkError(describe("renderbuffer", format, size, samples)); !checked) return checked.error();
    return buffer;
}

Sampler::Sampler(const SamplerOptions& options) {
    GLuint id = 0;
    glCreateSamplers(1, &id);
    _name = Name<deleteSampler>(id);
    glSamplerParameteri(id, GL_TEXTURE_MIN_FILTER, static_cast<GLint>(options.minFilter));
    glSamplerParameteri(id, GL_TEXTURE_MAG_FILTER, static_cast<GLint>(options.magFilter));
    glSamplerParameteri(id, GL_TEXTURE_WRAP_S, static_cast<GLint>(options.wrapS));
    glSamplerParameteri(id, GL_TEXTURE_WRAP_T, static_cast<GLint>(options.wrapT));
    glSamplerParameterfv(id, GL_TEXTURE_BORDER_COLOR, glm::value_ptr(options.borderColour));
    if (options.maxAnisotropy > 1) glSamplerParameterf(id, GL_TEXTURE_MAX_ANISOTROPY_EXT, options.maxAnisotropy);
    if (options.compare) {
        glSamplerParameteri(id, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
        glSamplerParameteri(id, GL_TEXTURE_COMPARE_FUNC, static_cast<GLint>(*options.compare));
    }
}

void Sampler::bind(GLuint unit) const {
    glBindSampler(unit, id());
}

}  // namespace umbriel::gl
