#include "server/shadow/darkness_images.h"

#include <fmt/format.h>

namespace umbriel {

Result<void> DarknessImages::reserve(PixelSize size, std::uint32_t samples, std::uint32_t layers, bool positions) {
    if (size == _size && samples == _samples && positions == _hasPositions && layers <= _layerTargets.size()) return {};
    if (layers == 0) {
        *this = {};
        return {};
    }
    GLint maxLayers = 0;
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &maxLayers);
    if (layers > static_cast<std::uint32_t>(maxLayers))
        return failure(fmt::format("{} lights with shadows made in the view are more than this driver allows ({})",
                                   layers, maxLayers));
    *this = {};
    const auto count = static_cast<GLsizei>(samples);
    GLuint id = 0;
    glCreateTextures(GL_TEXTURE_2D_MULTISAMPLE_ARRAY, 1, &id);
    _layers = gl::Name<gl::deleteTexture>(id);
    glTextureStorage3DMultisample(id, count, GL_R32F, size.width, size.height, static_cast<GLsizei>(layers), GL_TRUE);
    glCreateRenderbuffers(1, &id);
    _depth = gl::Name<gl::deleteRenderbuffer>(id);
    glNamedRenderbufferStorageMultisample(id, count, GL_DEPTH_COMPONENT32F, size.width, size.height);
    if (positions) {
        glCreateTextures(GL_TEXTURE_2D_MULTISAMPLE, 1, &id);
        _positions = gl::Name<gl::deleteTexture>(id);
        glTextureStorage2DMultisample(id, count, GL_RGBA32F, size.width, size.height, GL_TRUE);
    }
    const auto what = fmt::format("darkness of {} lights, {}x{} pixels", layers, size.width, size.height);
    if (auto checked = gl::checkError(what); !checked) return checked;
    const auto target = [&](GLuint colour, GLint layer) -> Result<gl::Name<gl::deleteFramebuffer>> {
        GLuint framebuffer = 0;
        glCreateFramebuffers(1, &framebuffer);
        gl::Name<gl::deleteFramebuffer> name(framebuffer);
        glNamedFramebufferRenderbuffer(framebuffer, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, _depth.id());
        if (colour != 0 && layer >= 0)
            glNamedFramebufferTextureLayer(framebuffer, GL_COLOR_ATTACHMENT0, colour, 0, layer);
        else if (colour != 0)
            glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, colour, 0);
        glNamedFramebufferDrawBuffer(framebuffer, colour != 0 ? GL_COLOR_ATTACHMENT0 : GL_NONE);
        glNamedFramebufferReadBuffer(framebuffer, GL_NONE);
        if (glCheckNamedFramebufferStatus(framebuffer, GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
            return failure(fmt::format("OpenGL: the driver cannot draw the {} with {} sample(s)", what, samples));
        return name;
    };
    auto surfaces = target(_positions.id(), -1);
    if (!surfaces) return surfaces.error();
    _surfaces = std::move(*surfaces);
    for (std::uint32_t layer = 0; layer < layers; ++layer) {
        auto made = target(_layers.id(), static_cast<GLint>(layer));
        if (!made) return made.error();
        _layerTargets.push_back(std::move(*made));
    }
    _size = size;
    _samples = samples;
    _hasPositions = positions;
    return {};
}

void DarknessImages::beginSurfaces() {
    glBindFramebuffer(GL_FRAMEBUFFER, _surfaces.id());
    glDepthMask(GL_TRUE);
    const float farthest = 0.0f;
    const float nothing[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    glClearNamedFramebufferfv(_surfaces.id(), GL_DEPTH, 0, &farthest);
    if (_hasPositions) glClearNamedFramebufferfv(_surfaces.id(), GL_COLOR, 0, nothing);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
}

void DarknessImages::beginLayer(std::uint32_t layer) {
    glBindFramebuffer(GL_FRAMEBUFFER, _layerTargets[layer].id());
    const float nothing[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    glClearNamedFramebufferfv(_layerTargets[layer].id(), GL_COLOR, 0, nothing);
    glDepthMask(GL_FALSE);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    // What lies before the near plane or beyond the far one still counts.
    glEnable(GL_DEPTH_CLAMP);
}

void DarknessImages::end() {
    glDisable(GL_BLEND);
    glDisable(GL_DEPTH_CLAMP);
    glDepthMask(GL_TRUE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glCullFace(GL_BACK);
}

}  // namespace umbriel
