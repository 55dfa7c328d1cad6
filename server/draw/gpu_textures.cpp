#include "server/draw/gpu_textures.h"

#include <fmt/format.h>

namespace umbriel {
namespace {

int channelsOf(TexelFormat format) {
    return static_cast<int>(format) + 1;
}

GLenum wrapOf(WrapMode mode) {
    switch (mode) {
        case WrapMode::Repeat:
            return GL_REPEAT;
        case WrapMode::MirroredRepeat:
            return GL_MIRRORED_REPEAT;
        case WrapMode::ClampToEdge:
            return GL_CLAMP_TO_EDGE;
    }
    return GL_REPEAT;
}

GLenum minFilterOf(FilterMode filter, MipMode mips) {
    const bool linear = filter == FilterMode::Linear;
    switch (mips) {
        case MipMode::None:
            return linear ? GL_LINEAR : GL_NEAREST;
        case MipMode::Nearest:
            return linear ? GL_LINEAR_MIPMAP_NEAREST : GL_NEAREST_MIPMAP_NEAREST;
        case MipMode::Linear:
            return linear ? GL_LINEAR_MIPMAP_LINEAR : GL_NEAREST_MIPMAP_LINEAR;
    }
    return GL_LINEAR;
}

std::vector<std::byte> rgba8Of(const Image& image, std::size_t texels, int channels) {
    std::vector<std::byte> source(texels * static_cast<std::size_t>(channels));
    image.texels.storage().read(0, source);
    if (channels == 4) return source;
    std::vector<std::byte> result(texels * 4, std::byte{255});
    for (std::size_t i = 0; i < texels; ++i) {
        const std::byte* from = source.data() + i * static_cast<std::size_t>(channels);
        std::byte* to = result.data() + i * 4;
        to[0] = from[0];
        to[1] = channels == 3 ? from[1] : from[0];
        to[2] = channels == 3 ? from[2] : from[0];
        if (channels == 2) to[3] = from[1];
    }
    return result;
}

}  // namespace

bool GpuTextures::isUsable(const Aspect& scene, ContainerId id) const {
    const Image* image = scene.findAs<Image>(id);
    if (!image) return false;
    const std::uint64_t width = image->width.get();
    const std::uint64_t height = image->height.get();
    const auto limit = static_cast<std::uint64_t>(_maxSize);
    const auto channels = static_cast<std::uint64_t>(channelsOf(image->format));
    return width > 0 && height > 0 && width <= limit && height <= limit &&
           image->texels.size() == width * height * channels;
}

Result<const gl::Texture2D*> GpuTextures::find(const Aspect& scene, ContainerId id, bool sRgb, bool mips) {
    const auto found = _entries.find({id, sRgb});
    if (found != _entries.end() && (found->second.mips || !mips)) return &found->second.texture;
    if (!isUsable(scene, id)) return nullptr;
    const Image* image = scene.findAs<Image>(id);
    const std::uint64_t width = image->width.get();
    const std::uint64_t height = image->height.get();
    const int channels = channelsOf(image->format);
    if (found != _entries.end()) forget(id);

    const glm::ivec2 size(static_cast<int>(width), static_cast<int>(height));
    const std::size_t bytes = width * height * 4 * (mips ? 4 : 3) / 3;
    if (_bytes + bytes > _budgetBytes)
        return failure(
            fmt::format("the scene's images need more than the {} MiB of texture memory allowed (image \"{}\", "
                        "{}x{}); raise the budget or scale the images down",
                        _budgetBytes >> 20, image->name.get(), width, height));
    auto texture = gl::Texture2D::create(sRgb ? GL_SRGB8_ALPHA8 : GL_RGBA8, size, mips ? gl::fullMipLevels(size) : 1);
    if (!texture) return texture.error();
    texture->upload(0, GL_RGBA, GL_UNSIGNED_BYTE, rgba8Of(*image, width * height, channels));
    if (mips) texture->generateMipmaps();
    _bytes += bytes;
    Entry& entry = _entries[{id, sRgb}];
    entry = {std::move(*texture), mips, bytes};
    return &entry.texture;
}

const gl::Sampler& GpuTextures::samplerFor(const Texture& texture) {
    gl::Sampler& sampler =
        _samplers[{texture.wrapS, texture.wrapT, texture.magFilter, texture.minFilter, texture.mipMode}];
    if (!sampler) {
        gl::SamplerOptions options;
        options.minFilter = minFilterOf(texture.minFilter, texture.mipMode);
        options.magFilter = texture.magFilter.get() == FilterMode::Linear ? GL_LINEAR : GL_NEAREST;
        options.wrapS = wrapOf(texture.wrapS);
        options.wrapT = wrapOf(texture.wrapT);
        sampler = gl::Sampler(options);
    }
    return sampler;
}

const gl::Sampler& GpuTextures::plainSampler() {
    if (!_plain) {
        gl::SamplerOptions options;
        options.minFilter = GL_LINEAR;
        options.wrapS = options.wrapT = GL_CLAMP_TO_EDGE;
        _plain = gl::Sampler(options);
    }
    return _plain;
}

void GpuTextures::forget(ContainerId image) {
    for (const bool sRgb : {false, true})
        if (const auto found = _entries.find({image, sRgb}); found != _entries.end()) {
            _bytes -= found->second.bytes;
            _entries.erase(found);
        }
}

}  // namespace umbriel
