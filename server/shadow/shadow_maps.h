#pragma once

#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "common/math/pixel_rect.h"
#include "common/wall/view.h"
#include "server/gl/buffer.h"

namespace umbriel {

class ShadowPainter;

// Texels that a block of bounds holds beyond its stride, on each side; as in shaders/snippet/shadow_filter.glsl.
inline constexpr float kBoundsMargin = 6.0f;
// The maps of a view are copied to a buffer when they are no more texels than this, which is what drivers' buffer
// textures hold; else none is.
inline constexpr std::uint64_t kLargestCopyTexels = std::uint64_t{1} << 27;

// The depth maps of one view, a layer for each fit: D32F, reversed (1 nearest the light, 0 at the far
// end and where nothing casts). Read by shaders/snippet/shadow.glsl.
class ShadowMaps {
 public:
    // Makes room for that many maps, and bounds of their blocks of boundsBlock x boundsBlock texels
    // (stage/shadow_bounds.frag.glsl; a multiple of 4) (0: none), which are found in copies. copies: depths are kept in
    // a buffer, too, layer after layer, row after row: a software renderer finds a texel's address there at a fraction
    // of what it costs in an array of images. True when maps drawn before are gone. Errors: the driver's limits, out of
    // memory.
    Result<bool> reserve(std::uint32_t mapSize, std::uint32_t layers, std::uint32_t boundsBlock, bool copies);

    // Starts drawing casters into a layer: clears it and sets viewport, scissor (texels that will be sampled), depth
    // state and slope bias. The caller draws with clipFromObject matrices made from the fit.
    void begin(std::uint32_t layer, const ShadowFit& fit, const PixelRect& texels);
    // Copies the layer, and restores the state that surfaces are drawn with.
    void end();
    // After a layer was drawn.
    Result<void> fillBounds(std::uint32_t layer, const ShadowFit& fit, ShadowPainter& painter);
    void bind(GLuint unit, GLuint boundsUnit) const;
    // Of the maps and their bounds.
    std::uint64_t bytes() const;

 private:
    std::uint32_t _mapSize = 0;
    std::uint32_t _boundsBlock = 0;
    std::uint32_t tilesAlong() const { return (_mapSize + 1) / 4 + 1; }
    Result<void> reserveTiles();
    Result<void> reserveCopies(std::uint32_t layers);

    bool _hasCopies = false;
    std::uint32_t _layer = 0;  // that is being drawn
    gl::Buffer _copies;
    gl::Name<gl::deleteTexture> _copyTexture;
    gl::Name<gl::deleteTexture> _tiles;  // of one layer at a time, on the way to its bounds
    gl::Name<gl::deleteFramebuffer> _tilesFramebuffer;
    gl::Name<gl::deleteTexture> _bounds;
    std::vector<gl::Name<gl::deleteFramebuffer>> _boundsFramebuffers;
    gl::Name<gl::deleteTexture> _texture;
    std::vector<gl::Name<gl::deleteFramebuffer>> _framebuffers;
};

}  // namespace umbriel
