#pragma once

#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "common/math/pixel_rect.h"
#include "server/gl/framebuffer.h"
#include "server/gl/object.h"

namespace umbriel {

// What keeps each light from the visible surfaces, pixel by pixel: for modules that work in the view instead of in the
// light's space, and for factors of maps that are filtered in the view. As large as the images tiles are worked on in,
// with as many samples. Layers are sums in floating point: 1 and more is dark, 0 lit; counts of volumes stay exact up
// to 2^24, where a stencil buffer wraps at 256.
class DarknessImages {
 public:
    // Which images there are.
    struct Needs {
        PixelSize size;
        std::uint32_t samples = 1;
        std::uint32_t layers = 0;
        bool positions = false;  // beside depth, where the surfaces lie
        bool normals = false;    // and which way they face
        bool edges = false;      // an image of the edges between them
        bool filter = false;     // an image between the two directions of a filter
        bool any() const { return layers > 0 || normals; }
        friend bool operator==(const Needs&, const Needs&) = default;
    };
    // Nothing needed: gives everything back. Errors: the driver's limits, out of memory.
    Result<void> reserve(const Needs& needs);

    // The functions below clear and draw within the scissor that is set.
    // Starts drawing depth, and positions (output 0: eye-relative world, w 1) and normals (output 1), of the surfaces
    // that light falls on.
    void beginSurfaces();
    // Starts adding into a layer, tested against the surfaces' depth without changing it; the caller sets the test.
    void beginLayer(std::uint32_t layer);
    // Starts writing the factors of the surfaces themselves into a layer.
    void beginFactors(std::uint32_t layer);
    // Start writing every pixel of the edges, of the image between the directions of the filter, and of a layer.
    void beginEdges() { beginImage(_edgesTarget); }
    void beginBetween() { beginImage(_betweenTarget); }
    void beginFiltered(std::uint32_t layer) { beginImage(_layerTargets[layer]); }
    // Restores the state that surfaces are drawn with.
    void end();

    // The layers, a sampler2DMSArray; the others sampler2DMS. Positions: w 0 where there is no surface.
    void bind(GLuint unit) const { glBindTextureUnit(unit, _layers.id()); }
    void bindPositions(GLuint unit) const { glBindTextureUnit(unit, _positions.id()); }
    void bindNormals(GLuint unit) const { glBindTextureUnit(unit, _normals.id()); }
    void bindEdges(GLuint unit) const { glBindTextureUnit(unit, _edges.id()); }
    void bindBetween(GLuint unit) const { glBindTextureUnit(unit, _between.id()); }

 private:
    using Texture = gl::Name<gl::deleteTexture>;
    using Target = gl::Name<gl::deleteFramebuffer>;
    void beginImage(const Target& target);

    Needs _needs;
    Texture _layers, _positions, _normals, _edges, _between;
    gl::Name<gl::deleteRenderbuffer> _depth;
    Target _surfaces, _edgesTarget, _betweenTarget;
    std::vector<Target> _layerTargets;
};

}  // namespace umbriel
