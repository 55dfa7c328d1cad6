#include "server/shadow/darkness_images.h"

#include <fmt/format.h>

#include <array>

namespace umbriel {
namespace {

constexpr std::array<float, 4> kNothing{};

struct Colour {
    GLuint texture = 0;
    GLint layer = -1;  // of an array; -1: none
};

Result<gl::Name<gl::deleteFramebuffer>> targetOf(GLuint depth, std::initializer_list<Colour> colours,
                                                 const std::string& what) {
    GLuint framebuffer = 0;
    glCreateFramebuffers(1, &framebuffer);
    gl::Name<gl::deleteFramebuffer> name(framebuffer);
    if (depth != 0) glNamedFramebufferRenderbuffer(framebuffer, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth);
    std::vector<GLenum> buffers;
    for (const Colour& colour : colours) {
        if (colour.texture == 0) continue;
        const GLenum attachment = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(buffers.size());
        if (colour.layer >= 0)
            glNamedFramebufferTextureLayer(framebuffer, attachment, colour.texture, 0, colour.layer);
        else
            glNamedFramebufferTexture(framebuffer, attachment, colour.texture, 0);
        buffers.push_back(attachment);
    }
    if (buffers.empty()) buffers.push_back(GL_NONE);
    glNamedFramebufferDrawBuffers(framebuffer, static_cast<GLsizei>(buffers.size()), buffers.data());
    glNamedFramebufferReadBuffer(framebuffer, GL_NONE);
    if (glCheckNamedFramebufferStatus(framebuffer, GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        return failure(fmt::format("OpenGL: the driver cannot draw the {}", what));
    return name;
}

}  // namespace

Result<void> DarknessImages::reserve(const Needs& needs) {
    if (!needs.any()) {
        *this = {};
        return {};
    }
    Needs kept = _needs;
    if (needs.layers <= kept.layers) kept.layers = needs.layers;
    if (needs == kept) return {};
    GLint maxLayers = 0;
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &maxLayers);
    if (needs.layers > static_cast<std::uint32_t>(maxLayers))
        return failure(fmt::format("{} lights with shadows made in the view are more than this driver allows ({})",
                                   needs.layers, maxLayers));
    *this = {};
    const auto count = static_cast<GLsizei>(needs.samples);
    const PixelSize size = needs.size;
    const bool isPlain = needs.samples == 1;  // shaders/snippet/view_images.glsl says why
    const auto image = [&](GLenum format) {
        GLuint id = 0;
        glCreateTextures(isPlain ? GL_TEXTURE_2D : GL_TEXTURE_2D_MULTISAMPLE, 1, &id);
        if (isPlain)
            glTextureStorage2D(id, 1, format, size.width, size.height);
        else
            glTextureStorage2DMultisample(id, count, format, size.width, size.height, GL_TRUE);
        return Texture(id);
    };
    GLuint id = 0;
    if (needs.layers > 0) {
        const auto layers = static_cast<GLsizei>(needs.layers);
        glCreateTextures(isPlain ? GL_TEXTURE_2D_ARRAY : GL_TEXTURE_2D_MULTISAMPLE_ARRAY, 1, &id);
        _layers = Texture(id);
        if (isPlain)
            glTextureStorage3D(id, 1, GL_R32F, size.width, size.height, layers);
        else
            glTextureStorage3DMultisample(id, count, GL_R32F, size.width, size.height, layers, GL_TRUE);
    }
    glCreateRenderbuffers(1, &id);
    _depth = gl::Name<gl::deleteRenderbuffer>(id);
    glNamedRenderbufferStorageMultisample(id, isPlain ? 0 : count, GL_DEPTH_COMPONENT32F, size.width, size.height);
    if (needs.positions) _positions = image(GL_RGBA32F);
    if (needs.normals) _normals = image(GL_RGBA16F);
    if (needs.edges) _edges = image(GL_R8);
    if (needs.filter) _between = image(GL_R32F);
    const auto what = fmt::format("darkness of {} lights, {}x{} pixels, {} sample(s)", needs.layers, size.width,
                                  size.height, needs.samples);
    if (auto checked = gl::checkError(what); !checked) return checked;
    const auto make = [&](Target& target, GLuint depth, std::initializer_list<Colour> colours) -> Result<void> {
        auto made = targetOf(depth, colours, what);
        if (!made) return made.error();
        target = std::move(*made);
        return {};
    };
    auto made = make(_surfaces, _depth.id(), {{_positions.id()}, {_normals.id()}});
    if (made && needs.edges) made = make(_edgesTarget, 0, {{_edges.id()}});
    if (made && needs.filter) made = make(_betweenTarget, 0, {{_between.id()}});
    _layerTargets.resize(needs.layers);
    for (std::uint32_t layer = 0; made && layer < needs.layers; ++layer)
        made = make(_layerTargets[layer], _depth.id(), {{_layers.id(), static_cast<GLint>(layer)}});
    if (made) _needs = needs;
    return made;
}

void DarknessImages::beginSurfaces() {
    glBindFramebuffer(GL_FRAMEBUFFER, _surfaces.id());
    glDepthMask(GL_TRUE);
    const float farthest = 0.0f;
    glClearNamedFramebufferfv(_surfaces.id(), GL_DEPTH, 0, &farthest);
    if (_positions) glClearNamedFramebufferfv(_surfaces.id(), GL_COLOR, 0, kNothing.data());
    if (_normals) glClearNamedFramebufferfv(_surfaces.id(), GL_COLOR, 1, kNothing.data());
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
}

void DarknessImages::beginLayer(std::uint32_t layer) {
    glBindFramebuffer(GL_FRAMEBUFFER, _layerTargets[layer].id());
    glClearNamedFramebufferfv(_layerTargets[layer].id(), GL_COLOR, 0, kNothing.data());
    glDepthMask(GL_FALSE);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    // What lies before the near plane or beyond the far one still counts.
    glEnable(GL_DEPTH_CLAMP);
}

void DarknessImages::beginFactors(std::uint32_t layer) {
    glBindFramebuffer(GL_FRAMEBUFFER, _layerTargets[layer].id());
    glClearNamedFramebufferfv(_layerTargets[layer].id(), GL_COLOR, 0, kNothing.data());
    glDepthMask(GL_FALSE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_EQUAL);
}

void DarknessImages::beginImage(const Target& target) {
    glBindFramebuffer(GL_FRAMEBUFFER, target.id());
    glDepthMask(GL_FALSE);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
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
