#pragma once

#include <span>
#include <vector>

#include "common/wall/tile_pixels.h"
#include "server/draw/frame_plan.h"
#include "server/gl/framebuffer.h"

namespace umbriel {

// The images that tiles are drawn into, and the finished tiles. Work images are as large as the wall (exact mode) or as
// a block of it (offset mode, see kBlockPixels) and used by one part of a tile after the other; what is finished is
// copied to images of the tile's own size.
class TileTargets {
 public:
    // Makes or keeps images for these tiles. lights: light-factor layers; apron: of the plan. Errors: out of memory.
    Result<void> reserve(const WallViews& views, std::span<const TileAssignment> tiles, std::uint32_t lights,
                         std::int32_t apron);

    // Starts a part of a tile: rectangles on the wall. block: what the work images stand for. Clears the part, grown by
    // reach.
    void beginPart(std::size_t tile, const PixelRect& part, const PixelRect& block, std::int32_t reach);
    // The wall pixel at the work images' pixel (0, 0).
    glm::ivec2 wallOrigin() const { return _origin; }
    // Target of colour passes.
    void bindColour() const { _colour.bind(); }
    // Layers besides light factors; a 1-sample depth of their own.
    void bindLayers() const { _layers.bind(); }
    // Factors of lights [16 * batch, ...): a target that readFactors() empties.
    void bindFactors() const { _factors.bind(); }
    bool hasLayers() const { return _layers.colourCount() > 0; }
    bool hasFactors() const { return _factors.colourCount() > 0; }
    std::uint32_t factorImages() const { return static_cast<std::uint32_t>(_factors.colourCount()); }
    void clearLayers();  // in the current scissor
    void clearFactors();
    void clearDepth(bool ofLayers);  // in the current scissor

    // Copies what is finished to the tile's own images, unless it is drawn in place.
    void endPart();
    // After the factors of a batch of lights were drawn for a view's region of the wall.
    Result<void> keepFactors(std::uint32_t firstLight, const PixelRect& wallRegion);

    // names: of the lights, in order.
    Result<std::vector<TilePixels>> read(std::span<const std::string> lightNames) const;
    std::uint64_t bytes() const { return _bytes; }

 private:
    struct Image {
        gl::Texture2D texture;
        GLenum format = 0;
    };
    struct Finished {
        TileAssignment tile;
        std::vector<gl::Texture2D> images;  // colour, then layers in order
        gl::Framebuffer framebuffer;  // empty when drawn in place
        PixelRect place;              // then: in the work images
        std::vector<std::vector<float>> factors;  // by light; read back, as there may be hundreds
    };
    PixelRect partInWork() const;

    // What the images were made for.
    PixelSize _workSize;
    std::uint32_t _samples = 0;
    std::uint32_t _layerMask = 0;
    ColourPrecision _precision = ColourPrecision::Float;
    std::uint32_t _lights = 0;
    bool _inPlace = false;

    std::vector<gl::Texture2D> _textures;
    std::vector<gl::Renderbuffer> _renderbuffers;
    gl::Framebuffer _colour;
    gl::Framebuffer _layers;
    gl::Framebuffer _factors;
    std::vector<Finished> _finished;
    std::size_t _tile = 0;
    PixelRect _part;
    glm::ivec2 _origin{0};
    std::uint64_t _bytes = 0;
};

}  // namespace umbriel
