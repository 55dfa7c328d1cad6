#pragma once

#include <map>
#include <utility>

#include "server/draw/gpu_scene.h"
#include "server/draw/shader_library.h"
#include "server/gl/vertex_array.h"
#include "server/shadow/darkness_images.h"

namespace umbriel {

// Fills views with what their viewports show of how shadows are made (Viewport::show): maps, factors, edges, and what
// of a map is read. The buffers and maps of the view's lights are bound by the caller.
class ShowPainter {
 public:
    explicit ShowPainter(ShaderLibrary& shaders) : _shaders(shaders) {}

    // Starts finding out what of the shown light's map is read; kept until the same view starts anew. Errors: out of
    // memory.
    Result<void> beginSeen(const ViewScene& scene);
    // Adds the surfaces in these pixels of the images. Leaves viewport and scissor changed.
    Result<void> addSeen(const ViewScene& scene, const DarknessImages& images, const PixelRect& pixels);
    void endSeen();

    // Within the viewport and scissor that are set.
    Result<void> show(const ViewScene& scene, const DarknessImages& images);

 private:
    struct Seen {
        gl::Name<gl::deleteTexture> texture;  // a layer for each part
        gl::Name<gl::deleteFramebuffer> framebuffer;
        std::uint32_t side = 0;
        std::uint32_t parts = 0;
    };
    ShaderLibrary& _shaders;
    std::map<std::pair<ContainerId, Eye>, Seen> _seen;  // by viewport
    gl::VertexArray _noVertices;
};

}  // namespace umbriel
