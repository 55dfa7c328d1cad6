#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "common/math/glm.h"
#include "server/gl/object.h"

namespace umbriel::gl {

// Levels of a full mip chain down to 1x1.
int fullMipLevels(glm::ivec2 size);

// What has a format and a size in the driver's memory. Base of the classes below; Delete: of the name.
template <void (*Delete)(GLuint)>
class ImageStorage {
 public:
    GLenum format() const { return _format; }
    glm::ivec2 size() const { return _size; }
    GLuint id() const { return _name.id(); }
    explicit operator bool() const { return static_cast<bool>(_name); }

 protected:
    ImageStorage() = default;
    ImageStorage(GLuint id, GLenum format, glm::ivec2 size) : _name(id), _format(format), _size(size) {}

 private:
    Name<Delete> _name;
    GLenum _format = 0;
    glm::ivec2 _size{0};
};

// A two-dimensional texture with immutable storage. `format` is a sized internal format (GL_RGBA32F,
// GL_SRGB8_ALPHA8, ...); sRGB formats decode to linear when sampled and filter in linear.
class Texture2D : public ImageStorage<deleteTexture> {
 public:
    Texture2D() = default;
    // Errors: out of memory, a size the driver does not offer.
    static Result<Texture2D> create(GLenum format, glm::ivec2 size, int levels = 1);

    // Replaces one level. `content` holds tightly packed rows, bottom row first, of `pixelFormat` (GL_RGBA, ...) and
    // `pixelType` (GL_UNSIGNED_BYTE, ...), and must be as large as the level.
    void upload(int level, GLenum pixelFormat, GLenum pixelType, std::span<const std::byte> content);
    // Fills levels 1.. from level 0.
    void generateMipmaps();
    void bind(GLuint unit) const;

    int levels() const { return _levels; }

 private:
    using ImageStorage::ImageStorage;

    int _levels = 0;
};

// Storage that is drawn to and never sampled. `samples` 0 means no multisampling.
class Renderbuffer : public ImageStorage<deleteRenderbuffer> {
 public:
    Renderbuffer() = default;
    // Errors: out of memory, more samples than the driver offers.
    static Result<Renderbuffer> create(GLenum format, glm::ivec2 size, int samples = 0);

    int samples() const { return _samples; }

 private:
    using ImageStorage::ImageStorage;

    int _samples = 0;
};

// A sampler's parameters, in OpenGL's terms.
struct SamplerOptions {
    GLenum minFilter = GL_LINEAR_MIPMAP_LINEAR;
    GLenum magFilter = GL_LINEAR;
    GLenum wrapS = GL_REPEAT;
    GLenum wrapT = GL_REPEAT;
    float maxAnisotropy = 1;
    // Set for shadow samplers, for example GL_LEQUAL; GL_LINEAR then filters 2x2 comparison results.
    std::optional<GLenum> compare;
    // Used with GL_CLAMP_TO_BORDER.
    glm::vec4 borderColour{0};
};

// How a texture is filtered and continued.
class Sampler {
 public:
    Sampler() = default;
    explicit Sampler(const SamplerOptions& options);

    void bind(GLuint unit) const;

    GLuint id() const { return _name.id(); }
    explicit operator bool() const { return static_cast<bool>(_name); }

 private:
    Name<deleteSampler> _name;
};

}  // namespace umbriel::gl
