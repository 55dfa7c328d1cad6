#include "server/shadow/shadow_maps.h"

#include <fmt/format.h>

#include "server/shadow/shadow_module.h"

namespace umbriel {
namespace {

// As in shaders/snippet/shadow_filter.glsl and stage/shadow_tiles.frag.glsl.
constexpr GLuint kCopyImageUnit = 0;

}  // namespace

Result<bool> ShadowMaps::reserve(std::uint32_t mapSize, std::uint32_t layers, std::uint32_t boundsBlock, bool copies) {
    if (mapSize == _mapSize && layers <= _framebuffers.size() && boundsBlock == _boundsBlock && copies == _hasCopies)
        return false;
    GLint maxSize = 0;
    GLint maxLayers = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &maxSize);
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &maxLayers);
    if (mapSize > static_cast<std::uint32_t>(maxSize) || layers > static_cast<std::uint32_t>(maxLayers))
        return failure(
            fmt::format("{} shadow maps of {} texels are more than this driver allows ({} of {}); choose a "
                        "smaller --map-size",
                        layers, mapSize, maxLayers, maxSize));
    _framebuffers.clear();
    _texture = {};
    GLuint id = 0;
    glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &id);
    _texture = gl::Name<gl::deleteTexture>(id);
    const auto side = static_cast<GLsizei>(mapSize);
    glTextureStorage3D(id, 1, GL_DEPTH_COMPONENT32F, side, side, static_cast<GLsizei>(layers));
    glTextureParameteri(id, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(id, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    if (auto checked = gl::checkError(fmt::format("{} shadow maps of {} texels", layers, mapSize)); !checked)
        return checked.error();
    for (std::uint32_t layer = 0; layer < layers; ++layer) {
        GLuint framebuffer = 0;
        glCreateFramebuffers(1, &framebuffer);
        _framebuffers.emplace_back(framebuffer);
        glNamedFramebufferTextureLayer(framebuffer, GL_DEPTH_ATTACHMENT, id, 0, static_cast<GLint>(layer));
        glNamedFramebufferDrawBuffer(framebuffer, GL_NONE);
        glNamedFramebufferReadBuffer(framebuffer, GL_NONE);
        if (glCheckNamedFramebufferStatus(framebuffer, GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
            return failure("OpenGL: the driver cannot draw into a layer of a depth array");
    }
    _bounds = {};
    _boundsFramebuffers.clear();
    if (boundsBlock > 0) {
        GLuint bounds = 0;
        glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &bounds);
        _bounds = gl::Name<gl::deleteTexture>(bounds);
        const auto blocks = static_cast<GLsizei>((mapSize + boundsBlock - 1) / boundsBlock);
        glTextureStorage3D(bounds, 1, GL_RGBA32F, blocks, blocks, static_cast<GLsizei>(layers));
        glTextureParameteri(bounds, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glTextureParameteri(bounds, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        if (auto checked = gl::checkError(fmt::format("bounds of {} shadow maps", layers)); !checked)
            return checked.error();
        for (std::uint32_t layer = 0; layer < layers; ++layer) {
            GLuint framebuffer = 0;
            glCreateFramebuffers(1, &framebuffer);
            _boundsFramebuffers.emplace_back(framebuffer);
            glNamedFramebufferTextureLayer(framebuffer, GL_COLOR_ATTACHMENT0, bounds, 0, static_cast<GLint>(layer));
            if (glCheckNamedFramebufferStatus(framebuffer, GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
                return failure("OpenGL: the driver cannot draw into a layer of an RGBA32F array");
        }
    }
    _boundsBlock = boundsBlock;
    _mapSize = mapSize;
    if (auto made = reserveTiles(); !made) return made.error();
    _hasCopies = copies;
    if (auto made = reserveCopies(layers); !made) return made.error();
    return true;
}

Result<void> ShadowMaps::reserveTiles() {
    _tiles = {};
    _tilesFramebuffer = {};
    if (_boundsBlock == 0) return {};
    GLuint texture = 0;
    glCreateTextures(GL_TEXTURE_2D, 1, &texture);
    _tiles = gl::Name<gl::deleteTexture>(texture);
    const auto side = static_cast<GLsizei>(tilesAlong());
    glTextureStorage2D(texture, 1, GL_RGBA32F, side, side);
    glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    if (auto checked = gl::checkError("tiles of a shadow map"); !checked) return checked;
    GLuint framebuffer = 0;
    glCreateFramebuffers(1, &framebuffer);
    _tilesFramebuffer = gl::Name<gl::deleteFramebuffer>(framebuffer);
    glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, texture, 0);
    if (glCheckNamedFramebufferStatus(framebuffer, GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        return failure("OpenGL: the driver cannot draw into an RGBA32F texture");
    return {};
}

Result<void> ShadowMaps::reserveCopies(std::uint32_t layers) {
    _copyTexture = {};
    _copies = {};
    if (!_hasCopies) return {};
    GLint most = 0;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &most);
    const std::uint64_t texels = std::uint64_t{_mapSize} * _mapSize * layers;
    if (texels > static_cast<std::uint64_t>(most))
        return failure(
            fmt::format("copies of {} shadow maps of {} texels are more than this driver's buffer textures hold "
                        "({} texels); choose a smaller --map-size, or --shadow-set skipUniform=false",
                        layers, _mapSize, most));
    auto made = gl::Buffer::create(texels * sizeof(float), 0);
    if (!made) return made.error();
    _copies = std::move(*made);
    GLuint texture = 0;
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &texture);
    _copyTexture = gl::Name<gl::deleteTexture>(texture);
    glTextureBuffer(texture, GL_R32F, _copies.id());
    return gl::checkError("copies of shadow maps");
}

Result<void> ShadowMaps::fillBounds(std::uint32_t layer, const ShadowFit& fit, ShadowPainter& painter) {
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_BLEND);
    const auto tiles = static_cast<GLsizei>(tilesAlong());
    glBindFramebuffer(GL_FRAMEBUFFER, _tilesFramebuffer.id());
    glViewport(0, 0, tiles, tiles);
    glBindImageTexture(kCopyImageUnit, _copyTexture.id(), 0, GL_TRUE, 0, GL_READ_ONLY, GL_R32F);
    auto filled =
        painter.fill("stage/shadow_tiles.frag.glsl", {static_cast<int>(layer), 0, static_cast<int>(fit.mapSize), 0});
    if (!filled) return filled;
    const auto blocks = static_cast<GLsizei>((_mapSize + _boundsBlock - 1) / _boundsBlock);
    glBindFramebuffer(GL_FRAMEBUFFER, _boundsFramebuffers[layer].id());
    glViewport(0, 0, blocks, blocks);
    glBindTextureUnit(0, _tiles.id());
    filled = painter.fill("stage/shadow_bounds.frag.glsl",
                          {0, static_cast<int>(_boundsBlock), static_cast<int>((fit.mapSize + 1) / 4 + 1), 0});
    glEnable(GL_SCISSOR_TEST);
    return filled;
}

void ShadowMaps::begin(std::uint32_t layer, const ShadowFit& fit, const PixelRect& texels) {
    _layer = layer;
    glBindFramebuffer(GL_FRAMEBUFFER, _framebuffers[layer].id());
    const auto side = static_cast<GLsizei>(fit.mapSize);
    glViewport(0, 0, side, side);
    glEnable(GL_DEPTH_TEST);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_GREATER);
    glDisable(GL_SCISSOR_TEST);
    const float farthest = 0.0f;
    glClearNamedFramebufferfv(_framebuffers[layer].id(), GL_DEPTH, 0, &farthest);
    glEnable(GL_SCISSOR_TEST);
    glScissor(texels.x, texels.y, texels.width, texels.height);
    // Any surface blocks light, whichever way it is wound.
    glDisable(GL_CULL_FACE);
    // Casters before a directional light's near plane still cast: their depth is clamped to it. A perspective map keeps
    // its near plane: behind it lies the light itself.
    if (!fit.perspective) glEnable(GL_DEPTH_CLAMP);
    if (fit.slopeBias != 0.0f) {
        glEnable(GL_POLYGON_OFFSET_FILL);
        // Away from the light, which is towards 0. No constant part: with a floating-point buffer its unit depends on
        // the depth itself.
        glPolygonOffset(-fit.slopeBias, 0.0f);
    }
}

void ShadowMaps::end() {
    glDisable(GL_DEPTH_CLAMP);
    glDisable(GL_POLYGON_OFFSET_FILL);
    if (!_hasCopies) return;
    const auto side = static_cast<GLsizei>(_mapSize);
    const std::size_t bytes = std::size_t{_mapSize} * _mapSize * sizeof(float);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, _copies.id());
    glGetTextureSubImage(_texture.id(), 0, 0, 0, static_cast<GLint>(_layer), side, side, 1, GL_DEPTH_COMPONENT,
                         GL_FLOAT, static_cast<GLsizei>(bytes), reinterpret_cast<void*>(bytes * _layer));
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
}

std::uint64_t ShadowMaps::bytes() const {
    const std::uint64_t blocks = _boundsBlock > 0 ? (_mapSize + _boundsBlock - 1) / _boundsBlock : 0;
    const std::uint64_t tiles = _boundsBlock > 0 ? tilesAlong() : 0;
    const std::uint64_t texel = _hasCopies ? 8 : 4;
    return (std::uint64_t{_mapSize} * _mapSize * texel + blocks * blocks * 16) * _framebuffers.size() +
           tiles * tiles * 16;
}

void ShadowMaps::bind(GLuint unit, GLuint boundsUnit) const {
    glBindTextureUnit(unit, _texture.id());
    if (_boundsBlock > 0) glBindTextureUnit(boundsUnit, _bounds.id());
    if (_hasCopies) glBindImageTexture(kCopyImageUnit, _copyTexture.id(), 0, GL_TRUE, 0, GL_READ_ONLY, GL_R32F);
}

}  // namespace umbriel
