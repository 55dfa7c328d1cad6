#pragma once

#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "common/math/pixel_rect.h"
#include "server/gl/framebuffer.h"
#include "server/gl/object.h"

namespace umbriel {

// What keeps each light from the visible surfaces, pixel by pixel: for modules that work in the view instead of in the
// light's space. As large as the images tiles are worked on in, with as many samples. Layers are sums in floating
// point: 1 and more is dark, 0 lit; counts of volumes stay exact up to 2^24, where a stencil buffer wraps at 256.
class DarknessImages {
 public:
    // positions: beside depth, where the surfaces lie. No layers: gives everything back. Errors: the driver's limits,
    // out of memory.
    Result<void> reserve(PixelSize size, std::uint32_t samples, std::uint32_t layers, bool positions);

    // The functions below clear and draw within the scissor that is set.
    // Starts drawing depth, and positions (output 0: eye-relative world, w 1), of the surfaces that light falls on.
    void beginSurfaces();
    // Starts adding into a layer, tested against the surfaces' depth without changing it; the caller sets the test.
    void beginLayer(std::uint32_t layer);
    // Restores the state that surfaces are drawn with.
    void end();

    // The layers, a sampler2DMSArray; the positions, a sampler2DMS (w 0: no surface).
    void bind(GLuint unit) const { glBindTextureUnit(unit, _layers.id()); }
    void bindPositions(GLuint unit) const { glBindTextureUnit(unit, _positions.id()); }

 private:
    PixelSize _size;
    std::uint32_t _samples = 0;
    bool _hasPositions = false;
    gl::Name<gl::deleteTexture> _layers, _positions;
    gl::Name<gl::deleteRenderbuffer> _depth;
    gl::Name<gl::deleteFramebuffer> _surfaces;
    std::vector<gl::Name<gl::deleteFramebuffer>> _layerTargets;
};

}  // namespace umbriel
