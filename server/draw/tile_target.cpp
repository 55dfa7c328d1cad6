#include "server/draw/tile_target.h"

#include <algorithm>

#include "server/draw/colour_format.h"
#include "server/gl/readback.h"

namespace umbriel {
namespace {

struct LayerFormat {
    Layer layer;
    const char* name;
    GLenum internal;
    GLenum pixels;
    std::uint32_t channels;
    GLenum type;
    ComponentType components;
};
// In the order of their output locations in shaders/stage/layers.frag.glsl.
constexpr LayerFormat kLayers[] = {
    {Layer::Depth, "depth", GL_R32F, GL_RED, 1, GL_FLOAT, ComponentType::Float},
    {Layer::Position, "position", GL_RGBA32F, GL_RGB, 3, GL_FLOAT, ComponentType::Float},
    {Layer::Normal, "normal", GL_RGBA32F, GL_RGB, 3, GL_FLOAT, ComponentType::Float},
    {Layer::Ids, "ids", GL_RG32UI, GL_RG_INTEGER, 2, GL_UNSIGNED_INT, ComponentType::Uint}};

LayerFormat colourLayer(ColourPrecision precision) {
    const ColourFormat format = colourFormatOf(precision);
    return {Layer::Colour, "colour", format.internal, GL_RGBA, 4, format.type, componentsOf(precision)};
}

bool wants(std::uint32_t mask, Layer layer) {
    return (mask & static_cast<std::uint32_t>(layer)) != 0;
}

std::vector<LayerFormat> formatsOf(std::uint32_t mask) {
    std::vector<LayerFormat> formats;
    for (const LayerFormat& format : kLayers)
        if (wants(mask, format.layer)) formats.push_back(format);
    return formats;
}

std::uint64_t bytesOf(GLenum format) {
    switch (format) {
        case GL_RGBA32F:
            return 16;
        case GL_RGBA16F:
        case GL_RG32UI:
            return 8;
        default:  // RGBA8, and one channel of 32 bits
            return 4;
    }
}

}  // namespace

Result<void> TileTargets::reserve(const WallViews& views, std::span<const TileAssignment> tiles, std::uint32_t lights,
                                  std::int32_t apron) {
    const PixelSize work = workSizeOf(views, apron);
    if (!wants(views.layers, Layer::LightFactors)) lights = 0;
    const std::uint32_t factorImages = (std::min(lights, kFactorLayersPerPass) + 3) / 4;
    const std::vector<LayerFormat> formats = formatsOf(views.layers);
    const bool sameTiles =
        _finished.size() == tiles.size() &&
        std::equal(tiles.begin(), tiles.end(), _finished.begin(),
                   [](const TileAssignment& a, const Finished& b) { return a.pixels == b.tile.pixels; });
    const bool inPlace = isDrawnInPlace(views, tiles);
    const GLenum colourFormat = colourFormatOf(views.colourPrecision).internal;
    const bool same = work == _workSize && inPlace == _inPlace && _samples == views.samples &&
                      _layerMask == views.layers && _precision == views.colourPrecision && sameTiles &&
                      static_cast<std::uint32_t>(_factors.colourCount()) == factorImages;
    if (same) {
        for (std::size_t i = 0; i < tiles.size(); ++i) _finished[i].tile = tiles[i];
    } else {
        _colour = {};
        _layers = {};
        _factors = {};
        _finished.clear();
        _textures.clear();
        _renderbuffers.clear();
        _textures.reserve(formats.size() + factorImages);
        _renderbuffers.reserve(3);
        _bytes = 0;
        _samples = 0;  // marks failure until all is done
        const glm::ivec2 size(work.width, work.height);
        const auto texels = static_cast<std::uint64_t>(work.width) * static_cast<std::uint64_t>(work.height);
        const int samples = views.samples > 1 ? static_cast<int>(views.samples) : 0;
        const auto renderbuffer = [&](GLenum format, int count) -> Result<const gl::Renderbuffer*> {
            auto made = gl::Renderbuffer::create(format, size, count);
            if (!made) return made.error();
            _bytes += texels * bytesOf(format) * static_cast<std::uint64_t>(std::max(count, 1));
            _renderbuffers.push_back(std::move(*made));
            return &_renderbuffers.back();
        };
        const auto texture = [&](GLenum format) -> Result<const gl::Texture2D*> {
            auto made = gl::Texture2D::create(format, size);
            if (!made) return made.error();
            _bytes += texels * bytesOf(format);
            _textures.push_back(std::move(*made));
            return &_textures.back();
        };
        auto colour = renderbuffer(colourFormat, samples);
        if (!colour) return colour.error();
        auto depth = renderbuffer(GL_DEPTH_COMPONENT32F, samples);
        if (!depth) return depth.error();
        const gl::Attachment colours[] = {gl::Attachment(**colour)};
        auto framebuffer = gl::Framebuffer::create(colours, gl::Attachment(**depth));
        if (!framebuffer) return framebuffer.error();
        _colour = std::move(*framebuffer);
        const gl::Renderbuffer* layerDepth = *depth;
        if (samples > 0 && (!formats.empty() || factorImages > 0)) {
            auto made = renderbuffer(GL_DEPTH_COMPONENT32F, 0);
            if (!made) return made.error();
            layerDepth = *made;
        }
        if (!formats.empty()) {
            std::vector<gl::Attachment> attachments;
            for (const LayerFormat& format : formats) {
                auto made = texture(format.internal);
                if (!made) return made.error();
                attachments.emplace_back(**made);
            }
            auto made = gl::Framebuffer::create(attachments, gl::Attachment(*layerDepth));
            if (!made) return made.error();
            _layers = std::move(*made);
        }
        if (factorImages > 0) {
            std::vector<gl::Attachment> attachments;
            for (std::uint32_t i = 0; i < factorImages; ++i) {
                auto made = texture(GL_RGBA32F);
                if (!made) return made.error();
                attachments.emplace_back(**made);
            }
            auto made = gl::Framebuffer::create(attachments, gl::Attachment(*layerDepth));
            if (!made) return made.error();
            _factors = std::move(*made);
        }
        for (const TileAssignment& tile : tiles) {
            Finished finished;
            finished.tile = tile;
            if (inPlace) {
                _finished.push_back(std::move(finished));
                continue;
            }
            std::vector<gl::Attachment> attachments;
            const glm::ivec2 tileSize(std::max(tile.pixels.width, 1), std::max(tile.pixels.height, 1));
            const auto add = [&](GLenum format) -> Result<void> {
                auto made = gl::Texture2D::create(format, tileSize);
                if (!made) return made.error();
                _bytes +=
                    static_cast<std::uint64_t>(tileSize.x) * static_cast<std::uint64_t>(tileSize.y) * bytesOf(format);
                finished.images.push_back(std::move(*made));
                return {};
            };
            auto added = add(colourFormat);
            for (const LayerFormat& format : formats)
                if (added) added = add(format.internal);
            if (!added) return added.error();
            for (const gl::Texture2D& image : finished.images) attachments.emplace_back(image);
            auto made = gl::Framebuffer::create(attachments);
            if (!made) return made.error();
            finished.framebuffer = std::move(*made);
            _finished.push_back(std::move(finished));
        }
        _workSize = work;
        _samples = views.samples;
        _layerMask = views.layers;
        _precision = views.colourPrecision;
        _inPlace = inPlace;
    }
    _lights = lights;
    for (Finished& finished : _finished) finished.factors.assign(lights, {});
    return {};
}

PixelRect TileTargets::partInWork() const {
    return {_part.x - _origin.x, _part.y - _origin.y, _part.width, _part.height};
}

void TileTargets::beginPart(std::size_t tile, const PixelRect& part, const PixelRect& block, std::int32_t reach) {
    _tile = tile;
    _part = part;
    _origin = {block.x, block.y};
    const PixelRect place = partInWork();
    glEnable(GL_SCISSOR_TEST);
    glScissor(place.x - reach, place.y - reach, place.width + 2 * reach, place.height + 2 * reach);
    glDepthMask(GL_TRUE);
    // Rounding to 8 bits must not depend on where in the window a pixel is.
    glDisable(GL_DITHER);
    _colour.clearColour(0, glm::vec4(0.0f));
    clearLayers();
}

void TileTargets::clearLayers() {
    if (!hasLayers()) return;
    const std::vector<LayerFormat> formats = formatsOf(_layerMask);
    for (std::size_t i = 0; i < formats.size(); ++i) {
        if (formats[i].layer == Layer::Ids)
            _layers.clearColourUint(static_cast<int>(i), glm::uvec4(0xffffffffu));
        else
            _layers.clearColour(static_cast<int>(i), glm::vec4(0.0f));
    }
}

void TileTargets::clearFactors() {
    for (int i = 0; i < _factors.colourCount(); ++i) _factors.clearColour(i, glm::vec4(0.0f));
}

void TileTargets::clearDepth(bool ofLayers) {
    if (!ofLayers)
        _colour.clearDepth(0.0f);
    else if (hasLayers())
        _layers.clearDepth(0.0f);
    else if (hasFactors())
        _factors.clearDepth(0.0f);
}

void TileTargets::endPart() {
    const PixelRect place = partInWork();
    Finished& finished = _finished[_tile];
    finished.place = place;
    if (_inPlace) return;
    const glm::ivec2 to(_part.x - finished.tile.pixels.x, _part.y - finished.tile.pixels.y);
    glDisable(GL_SCISSOR_TEST);
    const auto copy = [&](const gl::Framebuffer& source, int fromImage, int toImage) {
        glNamedFramebufferReadBuffer(source.id(), GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(fromImage));
        glNamedFramebufferDrawBuffer(finished.framebuffer.id(), GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(toImage));
        glBlitNamedFramebuffer(source.id(), finished.framebuffer.id(), place.x, place.y, place.x + place.width,
                               place.y + place.height, to.x, to.y, to.x + place.width, to.y + place.height,
                               GL_COLOR_BUFFER_BIT, GL_NEAREST);
    };
    copy(_colour, 0, 0);
    for (int i = 0; i < _layers.colourCount(); ++i) copy(_layers, i, i + 1);
}

Result<void> TileTargets::keepFactors(std::uint32_t firstLight, const PixelRect& wallRegion) {
    const PixelRect place = partInWork();
    Finished& finished = _finished[_tile];
    const PixelRect& tile = finished.tile.pixels;
    const glm::ivec2 toTile(_origin.x - tile.x, _origin.y - tile.y);  // from pixels of the work images
    const gl::PixelRect rect{{place.x, place.y}, {place.width, place.height}};
    // Views may overlap: this one's pixels replace what an earlier one left.
    const PixelRect region =
        intersect(place, {wallRegion.x - _origin.x, wallRegion.y - _origin.y, wallRegion.width, wallRegion.height});
    for (int image = 0; image < _factors.colourCount(); ++image) {
        if (firstLight + static_cast<std::uint32_t>(image) * 4 >= finished.factors.size()) break;
        auto pixels = gl::readPixelsFloat(_factors, image, rect);
        if (!pixels) return pixels.error();
        for (std::uint32_t channel = 0; channel < 4; ++channel) {
            const std::uint32_t light = firstLight + static_cast<std::uint32_t>(image) * 4 + channel;
            if (light >= finished.factors.size()) break;
            std::vector<float>& kept = finished.factors[light];
            kept.resize(static_cast<std::size_t>(tile.area()), 0.0f);
            for (std::int32_t y = region.y; y < region.y + region.height; ++y)
                for (std::int32_t x = region.x; x < region.x + region.width; ++x) {
                    const auto from = static_cast<std::size_t>(std::int64_t{y - place.y} * place.width + (x - place.x));
                    const auto to = static_cast<std::size_t>(std::int64_t{y + toTile.y} * tile.width + (x + toTile.x));
                    kept[to] = (*pixels)[from][static_cast<int>(channel)];
                }
        }
    }
    return {};
}

Result<std::vector<TilePixels>> TileTargets::read(std::span<const std::string> lightNames) const {
    std::vector<TilePixels> tiles;
    for (const Finished& finished : _finished) {
        TilePixels tile;
        tile.tile = finished.tile;
        const PixelRect& pixels = finished.tile.pixels;
        const glm::ivec2 corner = _inPlace ? glm::ivec2(finished.place.x, finished.place.y) : glm::ivec2(0);
        const gl::PixelRect rect{corner, {pixels.width, pixels.height}};
        const auto texels = static_cast<std::size_t>(pixels.area());
        std::vector<LayerFormat> formats = formatsOf(_layerMask);
        formats.insert(formats.begin(), colourLayer(_precision));
        for (std::size_t i = 0; i < formats.size(); ++i) {
            if (!wants(_layerMask, formats[i].layer)) continue;
            TileLayer layer;
            layer.layer = formats[i].layer;
            layer.name = formats[i].name;
            layer.channels = formats[i].channels;
            layer.components = formats[i].components;
            layer.pixels.resize(texels * layer.channels * bytesOf(layer.components));
            if (texels > 0) {
                const bool isColour = i == 0;
                const gl::Framebuffer& from = !_inPlace ? finished.framebuffer : isColour ? _colour : _layers;
                const int image = static_cast<int>(_inPlace && !isColour ? i - 1 : i);
                auto read = gl::readPixels(from, image, rect, formats[i].pixels, formats[i].type, layer.pixels);
                if (!read) return read.error();
            }
            tile.layers.push_back(std::move(layer));
        }
        for (std::size_t i = 0; i < finished.factors.size(); ++i) {
            TileLayer layer;
            layer.layer = Layer::LightFactors;
            layer.name = "light." + (i < lightNames.size() ? lightNames[i] : std::to_string(i));
            layer.channels = 1;
            std::vector<float> values = finished.factors[i];
            values.resize(texels, 0.0f);
            const auto bytes = std::as_bytes(std::span(values));
            layer.pixels.assign(bytes.begin(), bytes.end());
            tile.layers.push_back(std::move(layer));
        }
        tiles.push_back(std::move(tile));
    }
    return tiles;
}

}  // namespace umbriel
